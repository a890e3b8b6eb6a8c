/* SPDX-License-Identifier: MIT */
/* Streams of edges whose truth is known, and what a checker said of them. */
#ifndef TESTS_UNIT_SYNC0_BENCH_H
#define TESTS_UNIT_SYNC0_BENCH_H

#include <stdint.h>

#include "base/prng.h"
#include "base/sync0.h"
#include "sync0/checker.h"

enum { BENCH_LINES = 2, BENCH_EVENTS = 4096, BENCH_RESULTS = 16384 };

#define BENCH_PERIOD_NS INT64_C(1000000)
#define BENCH_DC0_NS INT64_C(845000000000000000)
#define BENCH_MONO0_NS INT64_C(7000000000000)

/* What becomes of a pulse: no pulse at the pin; a full queue drops the event; it is read. */
enum bench_fate { BENCH_NO_PULSE, BENCH_DROP, BENCH_GIVE };

enum bench_noise { BENCH_EXACT, BENCH_PI };

struct bench {
	struct checker_spec spec;
	struct checker *checker;
	struct prng prng;
	enum bench_noise noise;
	double dc_ppm;                 /* DC clock against the host's */
	double line_ppm[BENCH_LINES];  /* SYNC0 against DC */
	int64_t cycle_ns[BENCH_LINES]; /* of the pulses; 0: BENCH_PERIOD_NS */
	int64_t line_ns[BENCH_LINES];  /* and behind its time */
	int64_t pair_noise_ns;         /* wakes are late by up to this */
	int64_t cycle;                 /* next */
	/* Called for each edge; it may change it, and give others itself. */
	enum bench_fate (*alter)(struct bench *b, unsigned line, int64_t cycle, struct edge *edge);
	int64_t number_step;  /* added to the master's cycle numbers from now on */
	int64_t host_step_ns; /* added to all the host's times from now on */
	uint32_t seqno[BENCH_LINES];
	/* what came */
	struct sync0_result result[BENCH_RESULTS];
	unsigned results;
	struct event event[BENCH_EVENTS];
	unsigned events;
	double deviation_squares; /* of all periods */
	uint64_t deviations;
};

/** Two lines, windows of 1 s, limits that are off, noise as calibrated on a Pi-like board. */
struct bench *bench_create(void);
/** Make the checker; the spec may be changed before. */
void bench_start(struct bench *b);
void bench_destroy(struct bench *b);
void bench_run(struct bench *b, int64_t cycles);
/** The host's clock at @dc_ns. */
int64_t bench_mono_ns(const struct bench *b, int64_t dc_ns);
/** How many events of @id there are; the first is put into *ret if that is not NULL. */
unsigned bench_count(const struct bench *b, enum event_id id, struct event *ret);
/** The noise of one edge on a board like a Pi 5. */
int64_t bench_pi_noise_ns(struct prng *prng);
/** Sums over all windows of a line. */
uint64_t bench_missing(const struct bench *b, unsigned line);
uint64_t bench_extra(const struct bench *b, unsigned line);
/** Print every event: for a failed test. */
void bench_show(const struct bench *b);

#endif
