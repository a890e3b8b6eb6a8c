/* SPDX-License-Identifier: MIT */
/*
 * A bus is brought up to the mapping with a slave that lies: two simulated slaves whose answers are
 * changed or lost on the way back, or one with an EEPROM from anywhere. Then it is watched while a
 * slave loses its power and returns.
 *
 * Byte 0 chooses the slaves and, divided by CHOICES, what the changes are of and what else is done;
 * byte 1 is the number of changes (changes.h). What follows is the EEPROM.
 */
#include <errno.h>
#include <string.h>

#include "base/status.h"
#include "bus/bus.h"
#include "bus/esc_access.h"
#include "changes.h"
#include "devices/catalogue.h"
#include "segment/in_process.h"
#include "segment/segment.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum {
	HEAD_BYTES = 2,
	CHOICES = 12,
	/* Of byte 0, divided by CHOICES; the two low bits are an enum change_what. */
	WITH_IDENTIFICATION = 4,
	WITH_EEPROM = 8,
	SLAVES = 2,
	TRANSMIT_NS = 4000,
	LOOKS = 24,
	POWER_OFF_LOOK = 2,
	POWER_ON_LOOK = 6,
};

#define ENDS_NS (600 * NS_PER_S)
#define LOADED_NS (50 * NS_PER_MS)
#define LOOK_NS (50 * NS_PER_MS)

struct hostile {
	struct segment *segment;
	struct in_process *host;
	struct transport wire;
	struct changes changes;
	unsigned options;
};

static void must(int is_true)
{
	if (!is_true) {
		__builtin_trap();
	}
}

static int64_t now_ns(const struct hostile *h)
{
	struct platform platform = in_process_platform(h->host);

	return in_process_true_ns(h->host, platform.now(platform.ctx));
}

/* --- the wire --- */

static int wire_send(void *ctx, const uint8_t *frame, size_t len)
{
	struct hostile *h = ctx;

	must(now_ns(h) < ENDS_NS);
	return h->wire.send(h->wire.ctx, frame, len);
}

static int wire_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline, mono_t *ret_at)
{
	struct hostile *h = ctx;
	int r;

	do {
		r = h->wire.receive(h->wire.ctx, frame, capacity, deadline, ret_at);
	} while (r > 0 && !changes_apply(&h->changes, frame, (size_t)r));
	return r;
}

/* --- the segment --- */

static int make_slaves(unsigned choice, const uint8_t *sii, size_t sii_bytes, struct hostile *h)
{
	static const char *const names[] = { "el3104",      "akd",          "el2521",
					     "lan9252_evb", "wago_750_354", "el6910" };
	static struct slave_model model;
	struct segment_slave_spec specs[SLAVES];
	const char *name = names[choice / 2 % (sizeof(names) / sizeof(names[0]))];
	size_t count = 0;

	if (choice % 2 == 0 && sii_bytes <= SEGMENT_SII_BYTES &&
	    catalogue_sii_slave(sii, sii_bytes, 0, &specs[count]) == 0) {
		count++;
	}
	must(catalogue_find(name, &model) == 0);
	must(catalogue_slave(&model, (int)count, &specs[count]) == 0);
	count++;
	return segment_create(specs, count, 0, &h->segment);
}

/* --- the master --- */

static void check_line(int result, const char *error)
{
	must(memchr(error, '\0', BUS_ERROR_BYTES) != NULL);
	must(result >= 0 || error[0] != '\0');
}

static void check_channels(const struct bus *bus)
{
	size_t count;
	const struct channel *channel = bus_channels(bus, &count);

	must(count <= LIMIT_CHANNELS);
	for (size_t i = 0; i < count; i++) {
		must(memchr(channel[i].name, '\0', sizeof(channel[i].name)) != NULL);
		must((size_t)channel[i].bit_offset + channel[i].bit_len <=
		     (size_t)8 * LIMIT_IMAGE_BYTES);
	}
}

static void ignore_event(void *ctx, const struct event *ev)
{
	char text[200];

	(void)ctx;
	event_format(ev, text, sizeof(text));
}

static void watch(struct hostile *h, struct line *line, struct bus *bus)
{
	static struct status_page page;
	struct bus_watch_report report;

	for (unsigned i = 0; i < LOOKS; i++) {
		char who[128];

		if (i == POWER_OFF_LOOK) {
			segment_power_off(h->segment, 0, now_ns(h));
		} else if (i == POWER_ON_LOOK) {
			segment_power_on(h->segment, 0, now_ns(h));
		}
		bus_watch(bus, &page, ignore_event, NULL, &report);
		must(memchr(report.trouble, '\0', sizeof(report.trouble)) != NULL);
		must(bus_map_check(bus, who, sizeof(who)) == (who[0] != '\0'));
		bus_step(bus, NULL);
		line_sleep(line, (span_t){ LOOK_NS });
	}
}

static void run_job(struct sii_job *job, int begun)
{
	int r = begun;

	if (r == 0) {
		do {
			r = sii_job_step(job);
		} while (r == 1);
	}
	check_line(r, job->error);
}

/* An alias into the EEPROM of the first slave, then all of it. */
static void write_eeprom(struct bus *bus)
{
	static uint8_t image[SEGMENT_SII_BYTES];
	struct sii_job job;

	run_job(&job, sii_job_alias(&job, bus, 0, 0x1234, ESC_FORCED));
	run_job(&job, sii_job_read(&job, bus, 0, image, sizeof(image)));
}

static void configure(const struct hostile *h, struct config *cfg)
{
	config_defaults(cfg);
	cfg->bus_mailbox_timeout_ns = 100 * NS_PER_MS;
	if ((h->options & WITH_IDENTIFICATION) != 0) {
		cfg->slave_count = 1;
		cfg->slave[0].identification = 5;
	}
}

static void bring_up(struct hostile *h, struct line *line)
{
	static struct config cfg;
	char error[BUS_ERROR_BYTES] = "";
	struct bus *bus;
	int r;

	configure(h, &cfg);
	must(bus_create(&cfg, line, &bus) == 0);
	bus_listen(bus, ignore_event, NULL);
	r = bus_scan(bus, error);
	check_line(r, error);
	if (r >= 0) {
		r = bus_compare(bus, error);
		check_line(r, error);
	}
	if (r >= 0) {
		r = bus_map(bus, error);
		check_line(r, error);
	}
	if (r >= 0) {
		check_channels(bus);
		if ((h->options & WITH_EEPROM) != 0) {
			write_eeprom(bus);
		}
		watch(h, line, bus);
	}
	bus_stop(bus, error);
	bus_destroy(bus);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct hostile h = { 0 };
	struct transport transport = { .send = wire_send, .receive = wire_receive, .ctx = &h };
	struct line *line;
	const uint8_t *eeprom;

	if (size < HEAD_BYTES) {
		return 0;
	}
	h.options = data[0] / CHOICES;
	h.changes = (struct changes){ .what = (enum change_what)(h.options & 3),
				      .next = data + HEAD_BYTES,
				      .left = data[1] };
	if (h.changes.left > (size - HEAD_BYTES) / CHANGE_BYTES) {
		h.changes.left = (size - HEAD_BYTES) / CHANGE_BYTES;
	}
	size -= HEAD_BYTES + h.changes.left * CHANGE_BYTES;
	eeprom = h.changes.next + h.changes.left * CHANGE_BYTES;
	if (make_slaves(data[0] % CHOICES, eeprom, size, &h) < 0) {
		return 0;
	}
	must(in_process_create(&(struct in_process_spec){ .segment = h.segment,
							  .seed = 1,
							  .transmit_ns = TRANSMIT_NS },
			       &h.host) == 0);
	h.wire = in_process_transport(h.host);
	must(line_create(in_process_platform(h.host), transport, &line) == 0);
	line_bind(line);
	line_sleep(line, (span_t){ LOADED_NS });
	bring_up(&h, line);
	line_bind(NULL);
	line_destroy(line);
	in_process_destroy(h.host);
	segment_destroy(h.segment);
	return 0;
}
