/* SPDX-License-Identifier: MIT */
/*
 * cost_record FOLDER SLAVES CYCLES [CHANNELS]: the recorder records so many cycles at 1 ms, counted
 * (cost.h), with the default chunk and sync period. Prints the bytes of the file and the processor
 * time. CHANNELS: of each slave.
 */
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "base/event.h"
#include "config/config.h"
#include "cost/cost.h"
#include "cost/piccolos.h"
#include "record/recorder.h"

enum { SETTLE_CYCLES = 2000, CYCLES_A_STEP = 5, CHANNELS_MOST = 32 };

static struct piccolos piccolos;
static struct ring *ring;
static struct recorder *recorder;
static int64_t now_ns = 1000 * NS_PER_S;
static uint64_t cycle;

static mono_t world_now(void *ctx)
{
	(void)ctx;
	return (mono_t){ now_ns };
}

static void say(void *ctx, const char *line)
{
	(void)ctx;
	fprintf(stderr, "%s\n", line);
}

static void push(void *ctx)
{
	const unsigned *cycles = ctx;

	for (unsigned i = 0; i < *cycles; i++) {
		piccolos_push(&piccolos, ring, cycle++);
		now_ns += PICCOLO_PERIOD_NS;
	}
}

static void run(void *ctx)
{
	const unsigned *cycles = ctx;

	for (unsigned done = 0; done < *cycles; done += CYCLES_A_STEP) {
		unsigned n = *cycles - done < CYCLES_A_STEP ? *cycles - done : CYCLES_A_STEP;

		cost_aside(push, &n);
		while (recorder_step(recorder) == RECORDER_BUSY) {
		}
	}
}

static void start(const char *folder, const struct config *cfg)
{
	static char path[4][PATH_MAX];
	char error[256] = "";
	struct recorder_options options = { .ring_path = path[0],
					    .events_path = path[1],
					    .status_path = path[2],
					    .dir = path[3],
					    .chunk_period_ns = cfg->record_chunk_period_ns,
					    .sync_period_ns = cfg->record_sync_period_ns,
					    .values = cfg->record_values,
					    .zstd_level = (int)cfg->record_compression,
					    .config_path = "",
					    .config_text = "",
					    .platform = { .now = world_now },
					    .report = say };

	snprintf(path[0], sizeof(path[0]), "%s/samples", folder);
	snprintf(path[1], sizeof(path[1]), "%s/events", folder);
	snprintf(path[2], sizeof(path[2]), "%s/record-status", folder);
	snprintf(path[3], sizeof(path[3]), "%s/records", folder);
	ring = piccolos_ring(&piccolos, path[0], "sample", piccolos_sample_bytes(&piccolos));
	(void)piccolos_ring(&piccolos, path[1], "event", sizeof(struct event));
	if (recorder_create(&options, &recorder, error, sizeof(error)) < 0) {
		fprintf(stderr, "cost_record: %s\n", error);
		exit(1);
	}
}

int main(int argc, char **argv)
{
	static struct config cfg;
	unsigned settle = SETTLE_CYCLES;
	unsigned cycles;
	uint64_t bytes;

	if (argc != 4 && argc != 5) {
		fprintf(stderr, "usage: cost_record FOLDER SLAVES CYCLES [CHANNELS]\n");
		return 2;
	}
	config_defaults(&cfg);
	piccolos =
		piccolos_make(cost_number(argv[2], LIMIT_SLAVES),
			      argc == 5 ? cost_number(argv[4], CHANNELS_MOST) : PICCOLO_CHANNELS);
	cycles = cost_number(argv[3], 10000000);
	start(argv[1], &cfg);
	run(&settle);
	bytes = recorder_status(recorder)->bytes_written;
	cost_counted(run, &cycles);
	bytes = recorder_status(recorder)->bytes_written - bytes;
	printf("%u cycles, %" PRIu64 " bytes, %lld ns\n", cycles, bytes, cost_cpu_ns());
	if (recorder_finish(recorder) < 0 ||
	    recorder_status(recorder)->recorded_cycles != settle + (uint64_t)cycles) {
		fprintf(stderr, "cost_record: not all was recorded\n");
		return 1;
	}
	recorder_destroy(recorder);
	return 0;
}
