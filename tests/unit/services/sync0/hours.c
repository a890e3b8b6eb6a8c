/* SPDX-License-Identifier: MIT */
/* An hour of edges at 1 ms: nothing is said of clean ones, and each of the few bad ones is. */
#include <math.h>
#include <stdio.h>

#include "harness/test.h"
#include "unit/services/sync0/bench.h"

TEST(sync0, an_hour_of_clean_edges_with_pi_like_noise_raises_no_alarm)
{
	struct bench *b = bench_create();
	double worst_drift = 0;
	double worst_skew = 0;
	uint64_t edges = 0;

	b->noise = BENCH_PI;
	b->dc_ppm = -61;
	b->spec.window_ns = 10000 * BENCH_PERIOD_NS;
	bench_start(b);
	bench_run(b, 3611000);
	if (b->events != 0) {
		bench_show(b);
	}
	CHECK_EQ(b->events, 0);
	for (unsigned i = 0; i < b->results; i++) {
		const struct sync0_result *r = &b->result[i];

		CHECK_EQ(r->verdict, SYNC0_OK);
		CHECK_EQ(r->edges, r->cycles);
		edges += r->edges;
		worst_drift = fmax(worst_drift, fabs(r->drift_ppb + 61000));
		worst_skew = fmax(worst_skew, fabs((double)r->skew_ns));
		CHECK(fabs(r->drift_ppb + 61000) <= r->drift_error_ppb);
	}
	CHECK(edges >= 2 * UINT64_C(3600000));
	printf("%llu edges in windows of 10 s: drift off by at most %.1f ppb, skew by %.0f ns\n",
	       (unsigned long long)edges, worst_drift, worst_skew);
	CHECK(worst_drift < 20);
	CHECK(worst_skew < 10);
	bench_destroy(b);
}

static enum bench_fate one_in_100000(struct bench *b, unsigned line, int64_t cycle,
				     struct edge *edge)
{
	(void)b;
	(void)edge;
	return line == 1 && cycle % 100000 == 77777 ? BENCH_NO_PULSE : BENCH_GIVE;
}

TEST(sync0, one_missing_pulse_in_100000_is_found_each_time)
{
	struct bench *b = bench_create();
	unsigned found = 0;

	b->noise = BENCH_PI;
	b->dc_ppm = 20;
	b->spec.window_ns = 10000 * BENCH_PERIOD_NS;
	b->alter = one_in_100000;
	bench_start(b);
	bench_run(b, 2011000);
	for (unsigned i = 0; i < b->events; i++) {
		if (b->event[i].id == EVENT_SYNC0_MISSING) {
			CHECK_EQ(b->event[i].value, 77777 + 100000 * (int64_t)found);
			CHECK_EQ(b->event[i].slave_pos, 3);
			CHECK_EQ(b->event[i].arg[0], 1);
			found++;
		}
	}
	CHECK_EQ(found, 20);
	CHECK_EQ(b->events, found);
	CHECK_EQ(bench_extra(b, 0) + bench_extra(b, 1) + bench_missing(b, 0), 0);
	bench_destroy(b);
}
