/* SPDX-License-Identifier: MIT */
/*
 * What all cyclic loops of `./build.sh bench` have in common: the command line, the clock, and a
 * record of each cycle. tests/bench/peers.py says what they print and write.
 *
 *   PROGRAM NIC PERIOD_NS SETTLE CYCLES LIMIT_NS FREE_MS FILE
 */
#ifndef TESTS_BENCH_LOOP_H
#define TESTS_BENCH_LOOP_H

#include <stdint.h>
#include <stdio.h>

#define LOOP_ARGUMENTS "NIC PERIOD_NS SETTLE CYCLES LIMIT_NS FREE_MS FILE"
#define LOOP_NS_PER_S INT64_C(1000000000)

/* One cycle, as it is in FILE. */
struct loop_record {
	int64_t wake_ns;  /* CLOCK_MONOTONIC; 0: no frame was sent in this cycle */
	int64_t late_ns;  /* wake minus deadline */
	int64_t moved_ns; /* by so much a master has moved this deadline since: cycles skipped */
	int64_t round_ns; /* from before sending to after receiving */
	int64_t has_answered; /* 1: complete, with the expected WKC; 0: not */
};

struct loop_options {
	const char *nic;
	int64_t period_ns;
	int64_t settle;   /* cycles in OP that are not recorded */
	int64_t cycles;   /* that are */
	int64_t limit_ns; /* to wait for an answer, for so long */
	int64_t free_ms;  /* then exchange for so long without a pause; 0: not */
	const char *file;
};

struct loop {
	/* Send, receive; 1 if the answer is complete. */
	int (*exchange)(void *ctx);
	/* What to add to the next deadline, to follow the reference clock; NULL: nothing. */
	int64_t (*correction_ns)(void *ctx);
	void *ctx;
};

/** Ends the program with 2 if the arguments are not LOOP_ARGUMENTS. */
struct loop_options loop_read_options(int argc, char **argv);
int64_t loop_now_ns(void);
void loop_sleep_until(int64_t deadline_ns);
/** In OP: say so, run the cycles, write FILE, and run free. Ends the program with 1 if it fails. */
void loop_run(const struct loop_options *opt, const struct loop *loop);
/** Say that the slaves have reached OP at @at_ns. */
void loop_print_op(int64_t at_ns);
void loop_print_free(uint64_t answers, int64_t ns);
/** Write @count records to FILE. Ends the program with 1 if it fails. */
void loop_write(const char *file, const struct loop_record *records, size_t count);

#endif
