/* SPDX-License-Identifier: MIT */
/* What the fake ecdaqd shows: pages and rings. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/run_path.h"
#include "base/slave_place.h"
#include "base/sync0.h"
#include "fake.h"
#include "wire/al.h"

int64_t fake_clock_ns(clockid_t clock)
{
	struct timespec ts;

	clock_gettime(clock, &ts);
	return (int64_t)ts.tv_sec * NS_PER_S + ts.tv_nsec;
}

const char *fake_path(const struct fake *f, const char *file)
{
	static char path[CONFIG_PATH_BYTES];

	snprintf(path, sizeof(path), "%s/%s", f->dir, file);
	return path;
}

void fake_die(const char *what, int err)
{
	fprintf(stderr, "test_fake_daemon: %s: %s\n", what, strerror(err));
	exit(1);
}

/* 11 bits and 13 across a byte's border, 8 without a channel; names that C makes the same; one
 * channel over another. */
static void make_bits(struct channel *ch)
{
	ch[2].bit_len = 11;
	ch[3].type = CHANNEL_INT;
	ch[3].bit_len = 13;
	ch[3].bit_offset -= 5;
	ch[4].type = CHANNEL_FLOAT;
	snprintf(ch[2].name, sizeof(ch[2].name), "piccolo0.a b");
	snprintf(ch[3].name, sizeof(ch[3].name), "piccolo0.a-b");
	ch[ENTRIES + 5].bit_offset = ch[ENTRIES + 4].bit_offset + 3;
}

static void describe_more(struct fake *f)
{
	struct channel *adc = &f->meta.channel[2];

	adc->max = f->adc_max;
	if (f->has_bits) {
		make_bits(f->meta.channel);
	}
	/* The first in volts, the second in counts. */
	adc->scale = 3.3 / 4096;
	snprintf(adc->unit, sizeof(adc->unit), "V");
}

/* The number at @pos of a list with commas between. */
static uint16_t number_of(const char *list, unsigned pos)
{
	for (; pos > 0; pos--) {
		list += strcspn(list, ",");
		list += *list == ',';
	}
	return (uint16_t)strtoul(list, NULL, 10);
}

static uint16_t alias_of(const struct fake *f, unsigned pos)
{
	return f->aliases != NULL ? number_of(f->aliases, pos)
				  : (uint16_t)(f->alias > 0 ? f->alias
					       : pos == 1   ? 1001
							    : 0);
}

void fake_describe(struct fake *f)
{
	static const struct {
		const char *name;
		int type;
		unsigned bits;
		unsigned at; /* byte in the slave's outputs or inputs */
		int is_output;
	} entries[ENTRIES] = {
		{ "led", CHANNEL_BOOL, 1, 0, 1 },
		{ "oneshot_time", CHANNEL_UINT, 64, 1, 1 },
		{ "adc", CHANNEL_UINT, 16, 0, 0 },
		{ "counter", CHANNEL_UINT, 16, 2, 0 },
		{ "sample_time", CHANNEL_UINT, 64, 4, 0 },
		{ "status", CHANNEL_UINT, 8, 12, 0 },
	};

	f->meta.head = (struct sample_meta){
		.version = SAMPLE_VERSION,
		.slave_count = SLAVES,
		.channel_count = CHANNELS,
		.image_bytes = IMAGE_BYTES,
		.output_bytes = SLAVES * OUT_BYTES,
		.period_ns = STEP_NS,
		.session = (uint64_t)fake_clock_ns(CLOCK_TAI),
	};
	for (unsigned s = 0; s < SLAVES; s++) {
		struct slave_info *info = &f->meta.slave[s];

		*info = (struct slave_info){
			.vendor = 2,
			.product = 0x04570862,
			.revision = 0x0258008d,
			.slave_pos = (uint16_t)s,
			.station_addr = (uint16_t)(0x1001 + s),
			.alias = alias_of(f, s),
			.config_item = f->items == NULL ? 0 : number_of(f->items, s),
			.has_dc = 1,
			.is_dc_reference = s == 0,
			.dc_delay_ns = (int32_t)s * 310,
			.counter_channel = (int32_t)(s * ENTRIES + 3),
			.input_bits = IN_BYTES * 8,
			.output_bits = OUT_BYTES * 8,
		};
		snprintf(info->name, sizeof(info->name), "piccolo%u", s);
		/* A name in Latin-1, as some vendors have it in their SII. */
		snprintf(info->device, sizeof(info->device), "FB1111-Piccolo \xb5");
		for (unsigned e = 0; e < ENTRIES; e++) {
			struct channel *ch = &f->meta.channel[s * ENTRIES + e];
			unsigned base = entries[e].is_output ? s * OUT_BYTES
							     : SLAVES * OUT_BYTES + s * IN_BYTES;

			*ch = (struct channel){
				.slave_pos = (uint16_t)s,
				.index = entries[e].is_output ? 0x7000 : 0x6000,
				.subindex = (uint8_t)(entries[e].is_output ? e + 1 : e - 1),
				.type = (uint8_t)entries[e].type,
				.direction = (uint8_t)entries[e].is_output,
				.bit_len = (uint8_t)entries[e].bits,
				.bit_offset = (base + entries[e].at) * 8,
				.scale = 1,
			};
			snprintf(ch->name, sizeof(ch->name), "piccolo%u.%s", s, entries[e].name);
		}
	}
	describe_more(f);
}

static void describe_control(struct control_status *control, unsigned calls)
{
	if (calls == 0) {
		return;
	}
	snprintf(control->name, sizeof(control->name), "blink");
	snprintf(control->path, sizeof(control->path), "/usr/lib/blink.so");
	control->budget_ns = 200000;
	control->state = CONTROL_PARKED;
	control->calls = calls;
	control->overruns = 2;
	control->safe_cycles = 1;
	control->limited = 3;
	control->refused = 4;
	for (unsigned i = 0; i < calls; i++) {
		histogram_add(&control->time, i < 2 ? 300000 : 5000);
	}
}

/* A line; or two and two slaves behind ports 3 and 1 of the first. */
static void show_place(const struct fake *f, unsigned pos)
{
	struct slave_status *slave = &f->page->slave[pos];
	struct slave_place place = {
		.is_known = 1,
		.parent = (int)pos - 1,
		.parent_port = pos > 0,
		.open_ports = pos + 1 < f->slaves ? 3 : 1,
	};

	if (f->has_branches) {
		snprintf(slave->info.name, sizeof(slave->info.name), "piccolo%u", pos);
		slave->info.alias = alias_of(f, pos);
		if (slave->info.alias == 1001 || slave->info.alias == 1003) {
			snprintf(slave->group, sizeof(slave->group), "axes");
		}
		place.parent = pos == 3 ? 0 : place.parent;
		place.parent_port = pos == 1 ? 3 : place.parent_port;
		place.open_ports = pos == 0 ? 0xb : pos % 2 == 1 ? 3 : 1;
	}
	slave->place = slave_place_pack(&place);
	slave->cable_ns = pos == 0 ? -1 : 310;
}

void fake_make_status(struct fake *f)
{
	struct status_page *page = status_create(fake_path(f, CONFIG_RUN_STATUS), STATUS_MAGIC,
						 sizeof(*page), f->mode);

	if (page == NULL) {
		fake_die("status", errno);
	}
	f->page = page;
	page->is_simulated = 1;
	page->pid = getpid();
	page->start_tai_ns = fake_clock_ns(CLOCK_TAI) - 83 * NS_PER_S;
	page->session = f->meta.head.session;
	page->period_ns = STEP_NS;
	snprintf(page->version, sizeof(page->version), "0.1.0");
	snprintf(page->interface, sizeof(page->interface), "ecat0");
	status_text_set(&page->text_sequence, page->message, sizeof(page->message),
			"slave 1: \"quoted\"\ttext");
	page->bus_state = BUS_OP;
	page->bus_target = BUS_OP;
	page->link = STATUS_LINK_UP;
	page->link_mbps = 100;
	page->slave_count = f->slaves;
	page->slaves_expected = SLAVES;
	page->cycle_cpu = UINT32_MAX;
	page->rt_degraded = f->degraded;
	page->cycle.page_faults = f->page_faults;
	page->cycle.dc_state = DC_LOCKED;
	page->cycle.dc_lock_ns = 123456789;
	page->cycle.dc_diff_max_ns = 42;
	page->cycle.correction_ppb = -12;
	for (unsigned s = 0; s < SLAVES; s++) {
		page->slave[s].info = f->meta.slave[s];
		page->slave[s].al_state = 8;
	}
	for (unsigned s = 0; f->has_long_names && s < f->slaves && s < LIMIT_SLAVES; s++) {
		char *name = page->slave[s].info.name;

		memset(name, 'n', sizeof(page->slave[s].info.name) - 1);
		page->slave[s].al_state = AL_SAFEOP | AL_ERROR;
		page->slave[s].al_status_code = 0x002d;
	}
	for (unsigned s = 0; s < f->slaves && s < LIMIT_SLAVES; s++) {
		show_place(f, s);
	}
	describe_control(&page->control, f->control);
	page->slave[1].dc_diff_ns = -7;
	page->slave[1].al_status_code = 0x001b;
	page->slave[1].rx_errors[0] = 3;
	page->slave[1].forwarded_errors[2] = 4;
	page->slave[1].lost_links[1] = 255;
	page->slave[1].pdi_errors = 5;
	page->slave[1].are_errors_short = 1;
}

void fake_make_record_status(struct fake *f)
{
	const char *path = fake_path(f, CONFIG_RUN_RECORD_STATUS);
	struct record_status *record =
		run_path_own_folder(path) < 0
			? NULL
			: status_create(path, RECORD_STATUS_MAGIC, sizeof(*record), f->mode);

	if (record == NULL) {
		fake_die("record-status", errno);
	}
	f->record = record;
	record->pid = getpid();
	record->state = RECORD_RUNNING;
	record->recorded_cycles = 5000;
	record->recorded_gaps = 1;
	record->cycles_missing = 5;
	record->bytes_free = UINT64_C(3) << 30;
	status_text_set(&record->text_sequence, record->path, sizeof(record->path),
			"/var/lib/ecdaq/a.mcap.part");
}

void fake_make_sync0_status(struct fake *f)
{
	const char *path = fake_path(f, CONFIG_RUN_SYNC0_STATUS);
	struct sync0_status *page =
		run_path_own_folder(path) < 0
			? NULL
			: status_create(path, SYNC0_STATUS_MAGIC, sizeof(*page), f->mode);

	if (page == NULL) {
		fake_die("sync0-status", errno);
	}
	page->pid = getpid();
	page->beyond_count = (uint32_t)f->beyond;
	page->beyond_pos = LIMIT_SYNC0_LINES;
	snprintf(page->beyond_slave, sizeof(page->beyond_slave), "valve7");
	status_unmap(page, sizeof(*page));
}

void fake_make_rings(struct fake *f)
{
	struct ring_spec samples = {
		.kind = "sample",
		.payload_bytes = sample_head_bytes(SLAVES) + IMAGE_BYTES,
		.slot_count = RING_SLOTS,
		.meta = &f->meta,
		.meta_bytes = sizeof(f->meta),
		.period_ns = STEP_NS,
		.file_mode = f->mode,
	};
	struct ring_spec events = {
		.kind = "event",
		.payload_bytes = sizeof(struct event),
		.slot_count = 256,
		.file_mode = f->mode,
	};
	int r;

	samples.path = fake_path(f, CONFIG_RUN_SAMPLES);
	r = ring_create(&samples, &f->samples);
	if (r < 0) {
		fake_die("samples", -r);
	}
	events.path = fake_path(f, CONFIG_RUN_EVENTS);
	r = ring_create(&events, &f->events);
	if (r < 0) {
		fake_die("events", -r);
	}
}

void fake_emit(struct fake *f, enum event_id id, uint16_t slave_pos, int64_t value, int32_t arg)
{
	struct event ev = {
		.id = (uint16_t)id,
		.slave_pos = slave_pos,
		.value = value,
		.arg = { arg, 0 },
		.cycle = f->cycle,
		.mono_ns = fake_clock_ns(CLOCK_MONOTONIC),
		.tai_ns = fake_clock_ns(CLOCK_TAI),
	};

	ring_push(f->events, &ev, sizeof(ev), NULL, 0);
}
