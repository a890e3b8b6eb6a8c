/* SPDX-License-Identifier: MIT */
/*
 * cost_publish FOLDER SLAVES CYCLES: the publisher makes the messages of so many cycles, counted
 * (cost.h); the DDS library, which they are handed to, is not there. Prints how many there were.
 */
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>

#include "config/config.h"
#include "cost/cost.h"
#include "cost/piccolos.h"
#include "publish/sample_writer.h"

enum { SETTLE_CYCLES = 200, CYCLES_A_STEP = 5 };

static struct piccolos piccolos;
static struct ring *ring;
static struct reader *reader;
static struct sample_writer *writer;
static uint64_t cycle;
static uint64_t messages;

int topics_write(dds_entity_t entity, const void *message, int64_t utc_ns)
{
	(void)entity;
	(void)message;
	(void)utc_ns;
	messages++;
	return 0;
}

static void push(void *ctx)
{
	const unsigned *cycles = ctx;

	for (unsigned i = 0; i < *cycles; i++) {
		piccolos_push(&piccolos, ring, cycle++);
	}
}

static void run(void *ctx)
{
	const unsigned *cycles = ctx;

	for (unsigned done = 0; done < *cycles; done += CYCLES_A_STEP) {
		unsigned n = *cycles - done < CYCLES_A_STEP ? *cycles - done : CYCLES_A_STEP;

		cost_aside(push, &n);
		while (sample_writer_step(writer, n) == SAMPLE_WRITER_MORE) {
		}
	}
}

int main(int argc, char **argv)
{
	static struct config cfg;
	static struct topics topics;
	struct sample_counts counts = { 0 };
	unsigned settle = SETTLE_CYCLES;
	unsigned cycles;
	uint64_t lost;
	char path[PATH_MAX];

	if (argc != 4) {
		fprintf(stderr, "usage: cost_publish FOLDER SLAVES CYCLES\n");
		return 2;
	}
	config_defaults(&cfg);
	piccolos = piccolos_make(cost_number(argv[2], LIMIT_SLAVES), PICCOLO_CHANNELS);
	cycles = cost_number(argv[3], 10000000);
	snprintf(path, sizeof(path), "%s/samples", argv[1]);
	ring = piccolos_ring(&piccolos, path, "sample", piccolos_sample_bytes(&piccolos));
	if (reader_create(path, READER_AT_OLDEST, &reader) < 0 ||
	    reader_next(reader, &lost) != READER_BEGUN ||
	    sample_writer_create(reader, &cfg, &topics, &counts, &writer) < 0) {
		fprintf(stderr, "cost_publish: %s\n", reader_problem(reader));
		return 1;
	}
	run(&settle);
	messages = 0;
	cost_counted(run, &cycles);
	printf("%u cycles, %" PRIu64 " messages\n", cycles, messages);
	return counts.published == settle + (uint64_t)cycles && counts.missed == 0 ? 0 : 1;
}
