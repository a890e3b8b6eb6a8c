/* SPDX-License-Identifier: MIT */
/*
 * The same from the sample ring of ecdaqd, which it does not disturb: when the bus has reached OP,
 * the records of its cycles, and how many samples are good while it runs without pauses.
 *
 *   ring_times RING PERIOD_NS SETTLE CYCLES LIMIT_NS FREE_MS FILE
 *
 * FREE_MS: $ECDAQ_BENCH_SWITCH is the file whose first byte switches free.c on.
 */
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "loop.h"
#include "reader/reader.h"

enum { POLL_NS = 20000000, OP_SECONDS = 120 };

static struct reader *reader;

static void fail(const char *why)
{
	fprintf(stderr, "ring_times: %s\n", why);
	exit(1);
}

/* Of the next sample; ends the program if there is none within @seconds. */
static const struct sample_header *next_sample(int64_t seconds)
{
	int64_t until_ns = loop_now_ns() + seconds * LOOP_NS_PER_S;

	for (;;) {
		uint64_t lost;

		switch (reader_next(reader, &lost)) {
		case READER_SAMPLE:
			return reader_header(reader);
		case READER_LOST:
			fail("the ring is too short for so many cycles");
			break;
		case READER_BEGUN:
			break;
		case READER_ENDED:
			fail("ecdaqd has ended the session");
			break;
		case READER_EMPTY:
		case READER_WAITING:
			if (loop_now_ns() > until_ns) {
				fail("no sample in OP");
			}
			loop_sleep_until(loop_now_ns() + POLL_NS);
			break;
		}
	}
}

/* ecdaqd skips cycles that it is too late for: the next one has its own deadline. */
static struct loop_record record_of(const struct sample_header *h, int64_t period_ns)
{
	const uint32_t without = SAMPLE_LOST | SAMPLE_WKC_LOW | SAMPLE_SKIPPED;
	static int64_t skipped;
	struct loop_record record = { .wake_ns = h->wake_mono_ns,
				      .late_ns = h->wake_latency_ns,
				      .moved_ns = skipped * period_ns,
				      .round_ns = h->round_trip_ns < 0 ? 0 : h->round_trip_ns,
				      .has_answered = (h->flags & without) == 0 };

	if (h->flags & SAMPLE_SKIPPED) {
		skipped++;
		record.wake_ns = 0;
	} else {
		skipped = 0;
	}
	return record;
}

static void set_switch(int is_on)
{
	const char *path = getenv("ECDAQ_BENCH_SWITCH");
	int fd = path == NULL ? -1 : open(path, O_WRONLY | O_CLOEXEC);
	char byte = (char)is_on;

	if (fd < 0 || pwrite(fd, &byte, 1, 0) != 1) {
		fail("ECDAQ_BENCH_SWITCH: no such file");
	}
	close(fd);
}

/* The samples of the last part, as many as the ring still has, tell how many are good. */
static void run_free(int64_t free_ms, int64_t period_ns)
{
	uint64_t before = reader_newest(reader);
	int64_t start_ns = loop_now_ns();
	uint64_t good = 0;
	uint64_t seen = 0;
	uint64_t after;
	int64_t ns;

	set_switch(1);
	loop_sleep_until(start_ns + free_ms * 1000000);
	after = reader_newest(reader);
	ns = loop_now_ns() - start_ns;
	set_switch(0);
	reader_seek(reader, before > reader_oldest(reader) ? before : reader_oldest(reader));
	while (reader_cursor(reader) < after) {
		good += record_of(next_sample(1), period_ns).has_answered ? 1 : 0;
		seen++;
	}
	loop_print_free(seen == 0 ? 0 : (after - before) * good / seen, ns);
}

int main(int argc, char **argv)
{
	struct loop_options opt = loop_read_options(argc, argv);
	struct loop_record *records = calloc((size_t)opt.cycles + 1, sizeof(*records));
	const struct sample_header *h;

	if (records == NULL || reader_create(opt.nic, READER_AT_OLDEST, &reader) < 0) {
		fail("no memory");
	}
	do {
		h = next_sample(OP_SECONDS);
	} while (h->flags & SAMPLE_NOT_OP);
	printf("slaves %u\n", reader_table(reader)->meta.slave_count);
	loop_print_op(h->wake_mono_ns);
	/* All of it is in the ring: read it when it is over. */
	loop_sleep_until(h->wake_mono_ns + (opt.settle + opt.cycles + 2) * opt.period_ns);
	for (int64_t i = -opt.settle; i < opt.cycles; i++) {
		struct loop_record record = record_of(next_sample(OP_SECONDS), opt.period_ns);

		if (i >= 0) {
			records[i] = record;
		}
	}
	loop_write(opt.file, records, (size_t)opt.cycles);
	if (opt.free_ms > 0) {
		run_free(opt.free_ms, opt.period_ns);
	}
	free(records);
	reader_destroy(reader);
	return 0;
}
