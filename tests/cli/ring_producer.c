/* SPDX-License-Identifier: MIT */
/*
 * A master without a bus: writes synthetic samples of two slaves (PRODUCER_SLAVES) to a sample
 * ring, so that what reads rings is tested alone. piccolo0.adc is a 1 Hz sine of 0.5 V around 1 V,
 * that of the next slave the same a quarter period later; counters count; sample_time is the DC
 * time of the edge.
 *
 * usage: test_ring_producer RUN_DIR --cycles N [--pace] [--first N] [--skip FROM:COUNT] [--depth N]
 *        [--no-close] [--wait] [--events N] [--bad N] [--lost N] [--losses N] [--tai NS]
 *        [--session N]
 * --pace: one sample each millisecond; otherwise at once. --skip: cycle numbers with no sample.
 * --no-close: leave the ring open, as after a crash. --wait: end when standard input does. --bad:
 * in every Nth cycle, from 0, the sample of the last slave is bad. --lost: in every Nth the frame
 * is lost. --events: so many, each 100 cycles after the one before. --losses: then so many of lost
 * frames, 100 ms apart. --tai: CLOCK_TAI
 * of the first sample's edge; otherwise now. --session: its number; otherwise CLOCK_TAI now.
 */
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "base/event.h"
#include "base/platform.h"
#include "base/ring.h"
#include "base/sample.h"
#include "base/slave_set.h"
#include "config/config.h"

#ifndef PRODUCER_SLAVES
#define PRODUCER_SLAVES 2
#endif
#ifndef PRODUCER_ADCS
#define PRODUCER_ADCS 1
#endif
enum {
	SLAVES = PRODUCER_SLAVES,
	ADCS = PRODUCER_ADCS,
	SLAVE_CHANNELS = ADCS + 2,
	CHANNELS = SLAVE_CHANNELS * SLAVES + 1,
	TIMES_AT = 2 * ADCS, /* counter, sample_time: behind the values */
	SLAVE_BYTES = TIMES_AT + 12,
	IMAGE_BYTES = 1 + SLAVES * SLAVE_BYTES
};

#define PERIOD_NS NS_PER_MS

struct arguments {
	const char *run_dir;
	uint64_t cycles;
	uint64_t first;
	uint64_t skip_from;
	uint64_t skip_count;
	uint64_t depth;
	uint64_t events;
	uint64_t bad_every;
	uint64_t tai_ns;  /* 0: now */
	uint64_t session; /* 0: now */
	uint64_t lost_every;
	uint64_t losses;
	int has_pace;
	int is_left_open;
	int has_wait;
};

struct meta {
	struct sample_meta head;
	struct slave_info slave[SLAVES];
	struct channel channel[CHANNELS];
};

static int parse_arguments(int argc, char **argv, struct arguments *a)
{
	*a = (struct arguments){ .depth = 65536 };
	for (int i = 1; i < argc; i++) {
		const char *value = i + 1 < argc ? argv[i + 1] : "";

		if (strcmp(argv[i], "--pace") == 0) {
			a->has_pace = 1;
		} else if (strcmp(argv[i], "--no-close") == 0) {
			a->is_left_open = 1;
		} else if (strcmp(argv[i], "--wait") == 0) {
			a->has_wait = 1;
		} else if (strcmp(argv[i], "--cycles") == 0) {
			a->cycles = strtoull(argv[++i] != NULL ? value : "", NULL, 10);
		} else if (strcmp(argv[i], "--first") == 0) {
			a->first = strtoull(argv[++i] != NULL ? value : "", NULL, 10);
		} else if (strcmp(argv[i], "--depth") == 0) {
			a->depth = strtoull(argv[++i] != NULL ? value : "", NULL, 10);
		} else if (strcmp(argv[i], "--events") == 0) {
			a->events = strtoull(argv[++i] != NULL ? value : "", NULL, 10);
		} else if (strcmp(argv[i], "--bad") == 0) {
			a->bad_every = strtoull(argv[++i] != NULL ? value : "", NULL, 10);
		} else if (strcmp(argv[i], "--tai") == 0) {
			a->tai_ns = strtoull(argv[++i] != NULL ? value : "", NULL, 10);
		} else if (strcmp(argv[i], "--session") == 0) {
			a->session = strtoull(argv[++i] != NULL ? value : "", NULL, 10);
		} else if (strcmp(argv[i], "--losses") == 0) {
			a->losses = strtoull(argv[++i] != NULL ? value : "", NULL, 10);
		} else if (strcmp(argv[i], "--lost") == 0) {
			a->lost_every = strtoull(argv[++i] != NULL ? value : "", NULL, 10);
		} else if (strcmp(argv[i], "--skip") == 0) {
			if (sscanf(value, "%" SCNu64 ":%" SCNu64, &a->skip_from, &a->skip_count) !=
			    2) {
				return -EINVAL;
			}
			i++;
		} else if (argv[i][0] != '-' && a->run_dir == NULL) {
			a->run_dir = argv[i];
		} else {
			return -EINVAL;
		}
	}
	return a->run_dir != NULL ? 0 : -EINVAL;
}

static void add_channel(struct meta *m, unsigned n, const char *name, unsigned slave, int type,
			unsigned bits, unsigned offset)
{
	struct channel *ch = &m->channel[n];

	snprintf(ch->name, sizeof(ch->name), "piccolo%u.%s", slave, name);
	ch->slave_pos = (uint16_t)slave;
	ch->index = strcmp(name, "led") == 0 ? 0x7000 : 0x6000;
	ch->subindex = (uint8_t)(n % SLAVE_CHANNELS + 1);
	ch->type = (uint8_t)type;
	ch->direction = strcmp(name, "led") == 0 ? CHANNEL_OUTPUT : CHANNEL_INPUT;
	ch->bit_len = (uint8_t)bits;
	ch->bit_offset = offset;
	ch->scale = 1;
	if (strncmp(name, "adc", 3) == 0) {
		snprintf(ch->unit, sizeof(ch->unit), "V");
		ch->scale = 3.3 / 4096;
	}
}

static void describe(struct meta *m, uint64_t session)
{
	unsigned n = 0;

	*m = (struct meta){ .head = { .version = SAMPLE_VERSION,
				      .slave_count = SLAVES,
				      .channel_count = CHANNELS,
				      .image_bytes = IMAGE_BYTES,
				      .output_bytes = 1,
				      .tai_offset_s = 0,
				      .period_ns = PERIOD_NS,
				      .session = session } };
	for (unsigned s = 0; s < SLAVES; s++) {
		struct slave_info *info = &m->slave[s];
		unsigned base = 8 * (1 + s * SLAVE_BYTES);

		snprintf(info->name, sizeof(info->name), "piccolo%u", s);
		snprintf(info->device, sizeof(info->device), "FB1111-0141 Piccolo");
		info->vendor = 2;
		info->product = 0x04570862;
		info->slave_pos = (uint16_t)s;
		info->has_dc = 1;
		info->is_dc_reference = s == 0;
		info->counter_channel = (int32_t)n + ADCS;
		add_channel(m, n++, "adc", s, CHANNEL_UINT, 16, base);
		for (unsigned i = 1; i < ADCS; i++) {
			char name[16];

			snprintf(name, sizeof(name), "adc%u", i + 1);
			add_channel(m, n++, name, s, CHANNEL_UINT, 16, base + 16 * i);
		}
		base += 8 * TIMES_AT;
		add_channel(m, n++, "counter", s, CHANNEL_UINT, 16, base);
		add_channel(m, n++, "sample_time", s, CHANNEL_UINT, 64, base + 16);
	}
	add_channel(m, n, "led", 1, CHANNEL_BOOL, 1, 0);
}

static void fill_image(uint8_t *image, uint64_t cycle, int64_t dc_ns)
{
	double t = (double)(cycle % 1000) / 1000;

	image[0] = cycle / 500 % 2 != 0;
	for (unsigned s = 0; s < SLAVES; s++) {
		uint8_t *p = image + 1 + (size_t)s * SLAVE_BYTES;
		double volt = 1 + 0.5 * sin(2 * M_PI * (t - 0.25 * s));

		for (unsigned i = 0; i < ADCS; i++) {
			put_le16(p + (size_t)2 * i, (uint16_t)lround(volt / 3.3 * 4096));
		}
		put_le16(p + TIMES_AT, (uint16_t)cycle);
		put_le64(p + TIMES_AT + 2, (uint64_t)dc_ns);
	}
}

static void push(struct ring *ring, const struct arguments *a, uint64_t cycle, int64_t start_tai_ns)
{
	int64_t since_ns = (int64_t)(cycle - a->first) * PERIOD_NS;
	int64_t dc_ns = INT64_C(800000000) * NS_PER_S + since_ns;
	struct sample_header h = {
		.cycle = cycle,
		.dc_time_ns = dc_ns,
		.wake_mono_ns = since_ns,
		.wake_tai_ns = start_tai_ns + since_ns + PERIOD_NS / 2,
		.frame_dc_ns = dc_ns + PERIOD_NS / 2 + 15000,
		.wake_latency_ns = (int32_t)(cycle % 7) * 1000,
		.round_trip_ns = 30000,
		.dc_diff_ns = 12,
		.wkc = 6,
		.wkc_expected = 6,
	};
	static uint8_t image[IMAGE_BYTES];

	if (a->bad_every > 0 && cycle % a->bad_every == 0) {
		slave_set_add(&h.slaves_bad, SLAVES - 1);
	}
	if (a->lost_every > 0 && cycle % a->lost_every == 0) {
		h.flags |= SAMPLE_LOST;
	}
	fill_image(image, cycle, dc_ns);
	ring_push(ring, &h, sample_head_bytes(SLAVES), image, sizeof(image));
}

static void produce(struct ring *ring, struct ring *events, const struct arguments *a)
{
	struct platform platform = platform_posix();
	mono_t deadline = platform.now(platform.ctx);
	int64_t start_tai_ns = a->tai_ns > 0 ? (int64_t)a->tai_ns : platform.tai_ns(platform.ctx);

	for (uint64_t i = 0; i < a->events; i++) {
		struct event ev = { .id = EVENT_OUTPUT_SET,
				    .mono_ns = (int64_t)i + 1,
				    .tai_ns = start_tai_ns,
				    .cycle = a->first + 100 * i,
				    .value = (int64_t)i,
				    .slave_pos = 1 };

		ring_push(events, &ev, sizeof(ev), NULL, 0);
	}
	for (uint64_t i = 0; i < a->losses; i++) {
		struct event ev = { .id = EVENT_FRAME_LOST,
				    .mono_ns = (int64_t)i * 100 * NS_PER_MS,
				    .tai_ns = start_tai_ns,
				    .cycle = a->first + 100 * i,
				    .value = (int64_t)(a->first + 100 * i),
				    .arg = { 1 },
				    .slave_pos = EVENT_NO_SLAVE };

		ring_push(events, &ev, sizeof(ev), NULL, 0);
	}
	for (uint64_t i = 0; i < a->cycles; i++) {
		uint64_t cycle = a->first + i;

		if (a->has_pace) {
			deadline = mono_add(deadline, (span_t){ PERIOD_NS });
			platform.sleep_until(platform.ctx, deadline);
		}
		if (cycle < a->skip_from || cycle >= a->skip_from + a->skip_count) {
			push(ring, a, cycle, start_tai_ns);
		}
	}
}

static int make_ring(const char *dir, const char *file, struct ring_spec spec,
		     struct ring **ret_ring)
{
	char path[CONFIG_PATH_BYTES];
	int r;

	snprintf(path, sizeof(path), "%s/%s", dir, file);
	spec.path = path;
	spec.file_mode = 0644;
	r = ring_create(&spec, ret_ring);
	if (r < 0) {
		fprintf(stderr, "test_ring_producer: %s: %s\n", path, strerror(-r));
	}
	return r;
}

int main(int argc, char **argv)
{
	struct arguments a;
	static struct meta meta;
	struct ring *ring;
	struct ring *events;

	if (parse_arguments(argc, argv, &a) < 0) {
		fprintf(stderr, "test_ring_producer: see the top of ring_producer.c\n");
		return 2;
	}
	describe(&meta, a.session != 0 ? a.session : (uint64_t)platform_posix().tai_ns(NULL));
	if (make_ring(a.run_dir, CONFIG_RUN_EVENTS,
		      (struct ring_spec){ .kind = "event",
					  .payload_bytes = sizeof(struct event),
					  .slot_count = 1024 },
		      &events) < 0 ||
	    make_ring(a.run_dir, CONFIG_RUN_SAMPLES,
		      (struct ring_spec){ .kind = "sample",
					  .payload_bytes = sample_head_bytes(SLAVES) + IMAGE_BYTES,
					  .slot_count = a.depth,
					  .meta = &meta,
					  .meta_bytes = sizeof(meta),
					  .period_ns = PERIOD_NS },
		      &ring) < 0) {
		return 1;
	}
	produce(ring, events, &a);
	printf("%" PRIu64 "\n", meta.head.session);
	fflush(stdout);
	while (a.has_wait && getchar() != EOF) {
	}
	if (a.is_left_open) {
		_exit(0);
	}
	ring_destroy(ring);
	ring_destroy(events);
	return 0;
}
