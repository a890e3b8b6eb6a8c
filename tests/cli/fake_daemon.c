/* SPDX-License-Identifier: MIT */
/*
 * An ecdaqd without a bus, for tests of `ecdaq`: status page, recorder's page, sample and event
 * ring of two FB1111-Piccolo slaves, and an admin socket that answers by simple rules. Cycles go by
 * the clock, SPEED times as fast as real ones. It prints "ready" and ends at the end of standard
 * input, by `ecdaq stop`, or by SIGKILL.
 *
 * usage: test_fake_daemon RUN_DIR [SPEED=N] [JUMP=1] [RECORDER=0]
 * [ADMIN=mute|garbage|none|differs|half|wrong] [MODE=octal] [SLAVES=N] [BRANCHES=1] [ITEMS=N,...]
 * [BITS=1] [NOISY=1] [ALIAS=N] [FAULTS=N] [BEYOND=N] [ADC_MAX=V] [DEGRADED=BITS] [SII=FILE] JUMP:
 * every hundredth cycle number is followed by a gap of five. Each 64th frame is lost. The admin
 * socket: piccolo1.led belongs to the control program; objects 0x1018:1, 0x1008:0, 0x8000:2 exist,
 * 0x8000:1 cannot be written now; a one-shot time must be in the future. After an "l" on standard
 * input, slave 1 is lost; after any other byte it is not.
 */
#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "fake.h"

/* --- cycles --- */

int64_t fake_dc_ns(uint64_t cycle)
{
	return INT64_C(800000000) * NS_PER_S + (int64_t)cycle * STEP_NS;
}

static void convert(struct fake *f, unsigned s, int64_t dc_ns)
{
	uint8_t *in = f->image + SLAVES * OUT_BYTES + s * IN_BYTES;
	double t = (double)(f->cycle % 1000) / 1000 - 0.25 * s;

	put_le16(in, (uint16_t)lround((1 + 0.5 * sin(2 * M_PI * t)) / 3.3 * 4096));
	put_le16(in + 2, (uint16_t)f->conversions);
	if (f->armed_ns[s] == 0) {
		put_le64(in + 4, (uint64_t)dc_ns);
	} else if (dc_ns >= f->armed_ns[s] && get_le64(in + 4) != (uint64_t)f->armed_ns[s]) {
		put_le64(in + 4, (uint64_t)f->armed_ns[s]);
		put_le16(in, (uint16_t)(2000 + s));
	}
}

static void step(struct fake *f)
{
	struct cycle_stats *st = &f->page->cycle;
	struct sample_header header = {
		.cycle = f->cycle,
		.dc_time_ns = fake_dc_ns(f->cycle),
		.wake_mono_ns = fake_clock_ns(CLOCK_MONOTONIC),
		.wake_tai_ns = fake_clock_ns(CLOCK_TAI),
		.wake_latency_ns = 3000 + (int32_t)(f->cycle % 97) * 100,
		.round_trip_ns = 40000,
		.wkc = 6,
		.wkc_expected = 6,
	};

	if (f->cycle % 64 == 0) {
		header.flags = SAMPLE_LOST;
		header.slaves_bad = slave_set_all(SLAVES);
		header.round_trip_ns = -1;
		header.wkc = 0;
		st->frames_lost++;
		st->samples_bad += SLAVES;
	} else {
		f->conversions++;
		for (unsigned s = 0; s < SLAVES; s++) {
			convert(f, s, header.dc_time_ns);
			st->slave_good[s]++;
		}
		st->samples_good += SLAVES;
		histogram_add(&st->round_trip, header.round_trip_ns);
		histogram_add(&st->phase, (int64_t)(f->cycle % 11) - 5);
	}
	histogram_add(&st->wake_latency, header.wake_latency_ns);
	ring_push(f->samples, &header, sample_head_bytes(SLAVES), f->image, sizeof(f->image));
	st->cycles++;
	st->frames_sent++;
	st->cycle_number = f->cycle;
	st->dc_time_ns = header.dc_time_ns;
	f->cycle++;
	if (f->has_jump && f->cycle % 100 == 0) {
		f->cycle += 5;
	}
}

/* --- life --- */

static void parse(struct fake *f, int argc, char **argv)
{
	if (argc < 2) {
		fprintf(stderr, "test_fake_daemon: see the top of fake_daemon.c\n");
		exit(2);
	}
	f->dir = argv[1];
	for (int i = 2; i < argc; i++) {
		char *value = strchr(argv[i], '=');

		if (value == NULL) {
			fake_die(argv[i], EINVAL);
		}
		*value++ = '\0';
		if (strcmp(argv[i], "SPEED") == 0) {
			f->speed = strtol(value, NULL, 10);
		} else if (strcmp(argv[i], "JUMP") == 0) {
			f->has_jump = value[0] == '1';
		} else if (strcmp(argv[i], "RECORDER") == 0) {
			f->has_recorder = value[0] == '1';
		} else if (strcmp(argv[i], "ADMIN") == 0) {
			f->admin = value;
		} else if (strcmp(argv[i], "SII") == 0) {
			f->sii_path = value;
		} else if (strcmp(argv[i], "MODE") == 0) {
			f->mode = (unsigned)strtoul(value, NULL, 8);
		} else if (strcmp(argv[i], "SLAVES") == 0) {
			f->slaves = (unsigned)strtoul(value, NULL, 10);
		} else if (strcmp(argv[i], "DEAF") == 0) {
			f->is_deaf = value[0] == '1';
		} else if (strcmp(argv[i], "LONG") == 0) {
			f->has_long_names = value[0] == '1';
		} else if (strcmp(argv[i], "EBUS") == 0) {
			f->has_ebus = value[0] == '1';
		} else if (strcmp(argv[i], "BRANCHES") == 0) {
			f->has_branches = value[0] == '1';
			f->slaves = 5;
		} else if (strcmp(argv[i], "ALIAS") == 0) {
			f->alias = (unsigned)strtoul(value, NULL, 10);
		} else if (strcmp(argv[i], "ALIASES") == 0) {
			f->aliases = value;
		} else if (strcmp(argv[i], "ITEMS") == 0) {
			f->items = value;
		} else if (strcmp(argv[i], "BITS") == 0) {
			f->has_bits = value[0] == '1';
		} else if (strcmp(argv[i], "NOISY") == 0) {
			f->is_noisy = value[0] == '1';
		} else if (strcmp(argv[i], "BEYOND") == 0) {
			f->beyond = strtol(value, NULL, 10);
		} else if (strcmp(argv[i], "ADC_MAX") == 0) {
			f->adc_max = strtod(value, NULL);
		} else if (strcmp(argv[i], "FAULTS") == 0) {
			f->page_faults = strtoull(value, NULL, 10);
		} else if (strcmp(argv[i], "CONTROL") == 0) {
			f->control = (unsigned)strtoul(value, NULL, 10);
		} else if (strcmp(argv[i], "DEGRADED") == 0) {
			f->degraded = (uint32_t)strtoul(value, NULL, 0);
		} else {
			fake_die(argv[i], EINVAL);
		}
	}
}

/* One event each 500 cycles; heartbeat. */
static void look_alive(struct fake *f)
{
	f->page->heartbeat++;
	if (f->cycle % 500 == 0) {
		fake_emit(f, EVENT_FRAME_LOST, EVENT_NO_SLAVE, (int64_t)f->cycle, 1);
	}
}

static void live(struct fake *f)
{
	int64_t start_ns = fake_clock_ns(CLOCK_MONOTONIC);
	uint64_t steps = 0;
	char byte;

	while (!f->is_stopped) {
		struct pollfd fds[2] = { { .fd = STDIN_FILENO, .events = POLLIN },
					 { .fd = f->listener, .events = POLLIN } };
		int64_t due = (fake_clock_ns(CLOCK_MONOTONIC) - start_ns) * f->speed / STEP_NS;

		for (; (int64_t)steps < due; steps++) {
			step(f);
			look_alive(f);
		}
		if (poll(fds, 2, 1) < 0) {
			fake_die("poll", errno);
		}
		if ((fds[0].revents & (POLLIN | POLLHUP)) != 0) {
			if (read(STDIN_FILENO, &byte, 1) == 0) {
				break;
			}
			f->page->slave[1].is_lost = byte == 'l';
		}
		if ((fds[1].revents & POLLIN) != 0) {
			fake_serve_client(f);
		}
	}
}

int main(int argc, char **argv)
{
	static struct fake f = { .speed = 1,
				 .beyond = -1,
				 .has_recorder = 1,
				 .admin = "",
				 .mode = 0640,
				 .slaves = SLAVES,
				 .degraded = 1u << EVENT_RT_PRIORITY,
				 .cycle = FIRST_CYCLE };

	parse(&f, argc, argv);
	f.refresh_ms = 10;
	fake_describe(&f);
	fake_make_rings(&f);
	fake_make_status(&f);
	if (f.has_recorder) {
		fake_make_record_status(&f);
	}
	if (f.beyond >= 0) {
		fake_make_sync0_status(&f);
	}
	fake_listen(&f);
	fake_emit(&f, EVENT_STARTED, EVENT_NO_SLAVE, STEP_NS, SLAVES);
	fake_emit(&f, EVENT_SLAVE_LOST, 1, 0, 0);
	/* The first two seconds are there at once. */
	for (int i = 0; i < 2000; i++) {
		step(&f);
	}
	puts("ready");
	fflush(stdout);
	live(&f);
	f.page->bus_state_at_stop = f.page->bus_state;
	f.page->bus_state = BUS_STOPPED;
	fake_emit(&f, EVENT_STOPPED, EVENT_NO_SLAVE, (int64_t)f.cycle, 0);
	ring_destroy(f.samples);
	ring_destroy(f.events);
	unlink(fake_path(&f, CONFIG_RUN_ADMIN));
	return 0;
}
