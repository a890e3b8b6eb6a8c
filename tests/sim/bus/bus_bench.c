/* SPDX-License-Identifier: MIT */
#include "sim/bus/bus_bench.h"

#include <errno.h>

#include "base/bytes.h"
#include "base/prng.h"
#include "devices/catalogue.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum {
	SETTLE_CYCLES = 400,
	WATCH_CYCLES = 50,
	TRANSMIT_NS = 4000,
	SIGMA_NS = 2000,
	FEATURES_DC = 0x000c,
	NO_SLAVE_ADDR = 0x7777
};

#define TAI_START_NS (INT64_C(1795000000) * NS_PER_S)
#define DATA_FOLDER "../shared/data/sii"

/* --- the table --- */

static size_t load_sii(const char *name, uint8_t *image, size_t capacity)
{
	const char *dir = getenv("ECDAQ_DATA");
	char path[512];
	FILE *file;
	size_t len;

	snprintf(path, sizeof(path), "%s/%s.bin",
		 dir != NULL ? dir : ECDAQ_SOURCE_DIR "/" DATA_FOLDER, name);
	file = fopen(path, "rb");
	if (file == NULL) {
		SKIP("no SII images: set ECDAQ_DATA to their folder");
	}
	len = fread(image, 1, capacity, file);
	fclose(file);
	return len;
}

static void make_segment(struct bus_bench *b, const struct bench_spec *spec)
{
	static struct segment_slave_spec slaves[LIMIT_SLAVES];
	static uint8_t sii[BENCH_SIIS][SEGMENT_SII_BYTES];
	static struct esc_features clockless;
	static struct esc_features clocked;
	struct prng prng = { spec->seed };
	size_t n = 0;

	for (; n < spec->piccolos; n++) {
		CHECK_EQ(fb1111_piccolo_slave((int)n, &slaves[n]), 0);
	}
	for (unsigned i = 0; i < BENCH_SIIS && spec->sii[i] != NULL; i++, n++) {
		size_t len = load_sii(spec->sii[i], sii[i], sizeof(sii[i]));

		CHECK_EQ(catalogue_sii_slave(sii[i], len, (int)n, &slaves[n]), 0);
	}
	for (unsigned i = 0; i < BENCH_SIIS && spec->catalogue[i] != NULL; i++, n++) {
		static struct slave_model model;

		CHECK_EQ(catalogue_find(spec->catalogue[i], &model), 0);
		CHECK_EQ(catalogue_slave(&model, (int)n, &slaves[n]), 0);
	}
	for (unsigned i = 0; i < BENCH_SIIS && spec->image[i].bytes != NULL; i++, n++) {
		CHECK_EQ(catalogue_sii_slave(spec->image[i].bytes, spec->image[i].len, (int)n,
					     &slaves[n]),
			 0);
	}
	clocked = esc_et1100;
	clocked.is_dc_by_eeprom = 0;
	clockless = esc_et1100;
	clockless.dc = ESC_DC_NONE;
	clockless.has_sync_unit = 0;
	clockless.features = (uint16_t)(clockless.features & ~FEATURES_DC);
	for (size_t i = 0; i < n; i++) {
		if ((spec->clockless >> i & 1) != 0) {
			slaves[i].features = &clockless;
		}
		if ((spec->clocked >> i & 1) != 0) {
			slaves[i].features = &clocked;
		}
		slaves[i].ppm = spec->ppm[i];
		slaves[i].clock_start_ns = spec->clock_start_ns[i] != 0
						   ? spec->clock_start_ns[i]
						   : prng_below(&prng, UINT64_C(1) << 52);
	}
	CHECK_EQ(segment_create(slaves, n, 0, &b->segment), 0);
}

/* --- the master's transport: the host's, counted --- */

/*
 * A reference that does not answer: its reads go to an address that no slave has, and an FRMW
 * becomes the write that the others would see. The reference itself executes it, too, which is
 * subtracted from the returned WKC.
 */
static void mute(uint8_t *frame, size_t frame_len, uint16_t reference)
{
	struct ecat_datagram dg;
	size_t pos = 0;

	while (ecat_frame_next(frame, frame_len, &pos, &dg) == 1) {
		if (dg.ado == ESC_REG_DC_SYSTEM_TIME && dg.adp == reference &&
		    (dg.cmd == ECAT_CMD_FRMW || dg.cmd == ECAT_CMD_FPRD)) {
			put_le16(dg.data - 8, NO_SLAVE_ADDR);
		}
	}
}

void bench_mute_reference(struct bus_bench *b, int is_mute)
{
	b->is_reference_mute = is_mute;
}

static int muted_send(struct bus_bench *b, const uint8_t *frame, size_t frame_len)
{
	uint8_t copy[LIMIT_FRAME_BYTES];

	memcpy(copy, frame, frame_len);
	mute(copy, frame_len, bus_plan(b->bus)->dc_reference);
	return b->wire.send(b->wire.ctx, copy, frame_len);
}

/* The master must find its own address in the echo. */
static void unmute(const struct bus_bench *b, uint8_t *frame, size_t frame_len)
{
	struct ecat_datagram dg;
	size_t pos = 0;

	while (ecat_frame_next(frame, frame_len, &pos, &dg) == 1) {
		if (dg.adp == NO_SLAVE_ADDR) {
			put_le16(dg.data - 8, bus_plan(b->bus)->dc_reference);
			put_le16(dg.wkc,
				 (uint16_t)(get_le16(dg.wkc) - (dg.cmd == ECAT_CMD_FRMW ? 1 : 0)));
		}
	}
}

/* When the segment goes on, on the host's clock; 0: it does not stand still now. */
static mono_t end_of_pause(const struct bus_bench *b)
{
	struct platform platform = in_process_platform(b->host);
	mono_t now = platform.now(platform.ctx);

	if (b->pause_every_ns == 0 || now.ns % b->pause_every_ns >= b->pause_ns) {
		return (mono_t){ 0 };
	}
	return (mono_t){ now.ns - now.ns % b->pause_every_ns + b->pause_ns };
}

static int pass_on(struct bus_bench *b, const uint8_t *frame, size_t frame_len)
{
	return b->is_reference_mute ? muted_send(b, frame, frame_len)
				    : b->wire.send(b->wire.ctx, frame, frame_len);
}

static void count_eeprom(struct bus_bench *b, const uint8_t *frame, size_t frame_len)
{
	uint8_t copy[LIMIT_FRAME_BYTES];
	struct ecat_datagram dg;
	size_t pos = 0;

	memcpy(copy, frame, frame_len);
	while (ecat_frame_next(copy, frame_len, &pos, &dg) == 1) {
		b->eeprom_commands += dg.cmd == ECAT_CMD_FPWR && dg.ado == ESC_REG_EEPROM_CONTROL;
	}
}

static int counted_send(void *ctx, const uint8_t *frame, size_t frame_len)
{
	struct bus_bench *b = ctx;

	b->frames_sent++;
	count_eeprom(b, frame, frame_len);
	if (b->is_loopback || (end_of_pause(b).ns != 0 && b->held_count < BENCH_HELD)) {
		memcpy(b->held[b->held_count], frame, frame_len);
		b->held_len[b->held_count++] = frame_len;
		return 0;
	}
	return pass_on(b, frame, frame_len);
}

static int counted_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline,
			   mono_t *ret_at)
{
	struct bus_bench *b = ctx;
	struct platform platform = in_process_platform(b->host);
	mono_t end = end_of_pause(b);
	int r;

	if (end.ns != 0) {
		platform.sleep_until(platform.ctx, end.ns < deadline.ns ? end : deadline);
		if (end.ns >= deadline.ns) {
			return -EAGAIN;
		}
	}
	if (b->is_loopback && b->held_count > 0) {
		b->held_count = 0;
		memcpy(frame, b->held[0], b->held_len[0]);
		return (int)b->held_len[0];
	}
	for (unsigned i = 0; i < b->held_count; i++) {
		pass_on(b, b->held[i], b->held_len[i]);
	}
	b->held_count = 0;
	r = b->wire.receive(b->wire.ctx, frame, capacity, deadline, ret_at);
	if (r > 0) {
		unmute(b, frame, (size_t)r);
	}
	return r;
}

unsigned bench_frames_sent(const struct bus_bench *b)
{
	return b->frames_sent;
}

unsigned bench_mailbox_writes(const struct bus_bench *b)
{
	unsigned sum = 0;

	for (size_t i = 0; i < segment_slave_count(b->segment); i++) {
		sum += segment_esc(b->segment, i)->sm[0].completed;
	}
	return sum;
}

static void make_master(struct bus_bench *b)
{
	struct transport transport = { .send = counted_send, .receive = counted_receive, .ctx = b };

	b->wire = in_process_transport(b->host);
	CHECK_EQ(line_create(in_process_platform(b->host), transport, &b->line), 0);
	line_bind(b->line);
	CHECK_EQ(bus_create(&b->cfg, b->line, &b->bus), 0);
}

struct bus_bench *bench_create(const struct bench_spec *spec)
{
	struct bus_bench *b = calloc(1, sizeof(*b));
	struct in_process_spec host = {
		.seed = spec->seed,
		.host_ppm = spec->host_ppm,
		.tai_start_ns = spec->tai_start_ns != 0 ? spec->tai_start_ns : TAI_START_NS,
		.wake_sigma_ns = SIGMA_NS,
		.transmit_ns = TRANSMIT_NS,
	};

	CHECK(b != NULL);
	b->page = calloc(1, sizeof(*b->page));
	CHECK(b->page != NULL);
	make_segment(b, spec);
	b->faults = fault_plan_create(spec->seed, 0);
	host.segment = b->segment;
	host.faults = b->faults;
	CHECK_EQ(in_process_create(&host, &b->host), 0);
	config_defaults(&b->cfg);
	for (size_t i = 0; spec->settings != NULL && spec->settings[i] != NULL; i++) {
		if (config_set(&b->cfg, spec->settings[i], b->error, sizeof(b->error)) < 0) {
			test_fail(__FILE__, __LINE__, "%s", b->error);
		}
	}
	make_master(b);
	return b;
}

static void drop_master(struct bus_bench *b)
{
	exchange_destroy(b->ex);
	b->ex = NULL;
	bus_destroy(b->bus);
	line_destroy(b->line);
}

void bench_destroy(struct bus_bench *b)
{
	drop_master(b);
	in_process_destroy(b->host);
	fault_plan_destroy(b->faults);
	segment_destroy(b->segment);
	free(b->page);
	free(b);
}

void bench_new_master(struct bus_bench *b)
{
	drop_master(b);
	make_master(b);
}

int64_t bench_now_ns(const struct bus_bench *b)
{
	struct platform platform = in_process_platform(b->host);

	return in_process_true_ns(b->host, platform.now(platform.ctx));
}

void bench_fault(struct bus_bench *b, const char *line)
{
	fault_plan_restart(b->faults, bench_now_ns(b));
	if (fault_plan_add(b->faults, line, segment_slave_count(b->segment), b->error,
			   sizeof(b->error)) < 0) {
		test_fail(__FILE__, __LINE__, "%s", b->error);
	}
}

/* --- the cycle --- */

static void count_result(struct bus_bench *b)
{
	b->cycles++;
	b->ok += b->last.status == EXCHANGE_OK;
	b->lost += b->last.status == EXCHANGE_NO_FRAME;
	b->wkc_low += b->last.status == EXCHANGE_WKC_LOW;
}

static void one_cycle(struct bus_bench *b)
{
	struct platform platform = in_process_platform(b->host);
	int64_t period_ns = b->cfg.cycle_period_ns;

	platform.sleep_until(platform.ctx, b->deadline);
	b->last = exchange_run(b->ex, b->image,
			       mono_add(b->deadline, (span_t){ period_ns * 4 / 10 }));
	count_result(b);
	if (b->last.dc_time_ns > 0) {
		b->phase_error_ns = fold_ns(b->last.dc_time_ns - period_ns / 2, period_ns);
		b->deadline.ns -= b->phase_error_ns / 8;
	}
	exchange_ride(b->ex, &(struct exchange_window){
				     .period = { period_ns },
				     .wire_needed = { b->deadline.ns + period_ns * 95 / 100 },
				     .listen_until = { b->deadline.ns + period_ns * 8 / 10 },
			     });
	b->deadline.ns += period_ns;
}

static void wait_cycle(void *ctx, mono_t until)
{
	(void)until;
	one_cycle(ctx);
}

void bench_run(struct bus_bench *b, unsigned count)
{
	for (unsigned i = 0; i < count; i++) {
		one_cycle(b);
		bus_step(b->bus, b->ex);
	}
}

/* --- steps --- */

int bench_find(struct bus_bench *b)
{
	int r = bus_scan(b->bus, b->error);

	return r < 0 ? r : bus_compare(b->bus, b->error);
}

int bench_map(struct bus_bench *b)
{
	int r = bus_map(b->bus, b->error);

	return r < 0 ? r : bus_dc_setup(b->bus, b->error);
}

int bench_cycle(struct bus_bench *b)
{
	struct platform platform = in_process_platform(b->host);
	int r = exchange_create(bus_plan(b->bus), b->line, &b->ex);

	if (r < 0) {
		return r;
	}
	b->deadline = mono_add(platform.now(platform.ctx), (span_t){ b->cfg.cycle_period_ns });
	line_ride_begin(b->line, (struct line_waiter){ wait_cycle, b });
	bench_run(b, SETTLE_CYCLES);
	return 0;
}

int bench_to_op(struct bus_bench *b)
{
	int r = 0;

	if (bus_plan(b->bus)->dc_reference != 0) {
		r = bus_sync0_start(b->bus, b->last.dc_time_ns, b->error);
	}
	if (r >= 0) {
		r = bus_request_state(b->bus, AL_SAFEOP, (span_t){ 10 * NS_PER_S }, b->error);
	}
	return r < 0 ? r : bus_request_state(b->bus, AL_OP, (span_t){ 10 * NS_PER_S }, b->error);
}

static void must(struct bus_bench *b, int r, const char *what)
{
	if (r < 0) {
		test_fail(__FILE__, __LINE__, "%s: %d: %s", what, r, b->error);
	}
}

void bench_bring_up(struct bus_bench *b)
{
	must(b, bench_find(b), "find");
	must(b, bench_map(b), "map");
	must(b, bench_cycle(b), "cycle");
	must(b, bench_to_op(b), "to OP");
}

static void on_event(void *ctx, const struct event *ev)
{
	struct bus_bench *b = ctx;

	b->events[ev->id]++;
	b->last_event[ev->id] = *ev;
}

struct bus_watch_report bench_watch(struct bus_bench *b)
{
	struct bus_watch_report report = { 0 };

	bus_watch(b->bus, b->page, on_event, b, &report);
	bus_lead_back(b->bus, on_event, b);
	return report;
}

unsigned bench_recover(struct bus_bench *b, unsigned limit)
{
	uint64_t from = b->cycles;

	while (b->cycles - from < limit) {
		bench_run(b, WATCH_CYCLES);
		if (bench_watch(b).is_all_op) {
			return (unsigned)(b->cycles - from);
		}
	}
	test_fail(__FILE__, __LINE__, "not in OP again after %u cycles", limit);
}

int bench_stop(struct bus_bench *b)
{
	int r = bus_stop(b->bus, b->error);

	line_ride_end(b->line);
	return r;
}

const struct channel *bench_channel(const struct bus_bench *b, const char *name)
{
	size_t count;
	const struct channel *channels = bus_channels(b->bus, &count);

	for (size_t i = 0; i < count; i++) {
		if (strcmp(channels[i].name, name) == 0) {
			return &channels[i];
		}
	}
	test_fail(__FILE__, __LINE__, "no channel %s", name);
}

uint64_t bench_value(const struct bus_bench *b, const char *name)
{
	const struct channel *ch = bench_channel(b, name);
	uint64_t value = 0;

	for (unsigned i = 0; i < ch->bit_len; i++) {
		uint32_t bit = ch->bit_offset + i;

		value |= (uint64_t)(b->image[bit / 8] >> (bit % 8) & 1) << i;
	}
	return value;
}
