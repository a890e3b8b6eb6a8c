/* SPDX-License-Identifier: MIT */
/* Slaves whose SYNC0 has not the cycle of the master: every second one, two in each, shifted. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>

#include "harness/test.h"
#include "unit/services/sync0/bench.h"

#define SLOW_NS (2 * BENCH_PERIOD_NS)
#define FAST_NS (BENCH_PERIOD_NS / 2)
#define SLOW_SHIFT_NS INT64_C(1250000)
#define FAST_SHIFT_NS INT64_C(-100000)

/* The first line's SYNC0 comes every second cycle, the second's twice in each. */
static struct bench *slow_and_fast(void)
{
	struct bench *b = bench_create();

	b->noise = BENCH_PI;
	b->dc_ppm = 37;
	b->spec.line[0].cycle_ns = b->cycle_ns[0] = SLOW_NS;
	b->spec.line[0].shift_ns = b->line_ns[0] = SLOW_SHIFT_NS;
	b->spec.line[1].cycle_ns = b->cycle_ns[1] = FAST_NS;
	b->spec.line[1].shift_ns = b->line_ns[1] = FAST_SHIFT_NS;
	return b;
}

TEST(sync0_cycles, pulses_of_every_second_cycle_and_of_half_a_cycle_are_as_they_must_be)
{
	struct bench *b = slow_and_fast();

	bench_start(b);
	bench_run(b, 20200);
	bench_show(b);
	CHECK_EQ(b->events, 0);
	CHECK(b->results >= 38);
	for (unsigned i = 0; i < b->results; i++) {
		const struct sync0_result *r = &b->result[i];
		int64_t cycle_ns = b->cycle_ns[r->line];

		CHECK_EQ(r->cycles, 1000 * BENCH_PERIOD_NS / cycle_ns);
		CHECK_EQ(r->edges, r->cycles);
		CHECK_EQ(r->missing + r->extra, 0);
		CHECK(fabs(r->period_ns - (double)cycle_ns) < 1e-4 * (double)cycle_ns);
		CHECK(fabs(r->drift_ppb - 37000) <= r->drift_error_ppb);
		CHECK(fabs(r->rate_ppb) <= r->rate_error_ppb);
		CHECK(llabs(r->phase_ns - b->line_ns[r->line]) <= r->phase_error_ns);
		CHECK(llabs(r->frame_ns - (BENCH_PERIOD_NS / 2 - b->line_ns[r->line])) < 5000);
		CHECK(r->line == 0 || (r->has & SYNC0_HAS_SKEW) != 0);
		CHECK(r->line == 0 || llabs(r->skew_ns) <= r->skew_error_ns);
		CHECK(r->verdict == SYNC0_OK || r->verdict == SYNC0_UNRESOLVED);
	}
	CHECK(b->deviation_squares / (double)b->deviations < 2e3 * 2e3);
	bench_destroy(b);
}

/* A shift of nearly a whole cycle is no pulse of the next one. */
TEST(sync0_cycles, a_shift_of_most_of_the_cycle_is_expected)
{
	struct bench *b = bench_create();

	b->spec.line[1].shift_ns = b->line_ns[1] = 900000;
	bench_start(b);
	bench_run(b, 5200);
	bench_show(b);
	CHECK_EQ(b->events, 0);
	for (unsigned i = 0; i < b->results; i++) {
		CHECK(llabs(b->result[i].phase_ns - b->line_ns[b->result[i].line]) <=
		      b->result[i].phase_error_ns);
	}
	bench_destroy(b);
}

static enum bench_fate drop_two(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	(void)b;
	(void)edge;
	return (line == 0 && cycle == 5000) || (line == 1 && cycle == 5001) ? BENCH_NO_PULSE
									    : BENCH_GIVE;
}

TEST(sync0_cycles, missing_pulses_have_the_number_of_the_masters_cycle)
{
	struct bench *b = slow_and_fast();
	unsigned found = 0;

	b->alter = drop_two;
	bench_start(b);
	bench_run(b, 8200);
	CHECK_EQ(bench_missing(b, 0), 1);
	CHECK_EQ(bench_missing(b, 1), 2);
	for (unsigned i = 0; i < b->events; i++) {
		CHECK_EQ(b->event[i].id, EVENT_SYNC0_MISSING);
		CHECK_EQ(b->event[i].value, b->event[i].line == 1 ? 5000 : 5001);
		CHECK_EQ(b->event[i].arg[0], b->event[i].line == 1 ? 1 : 2);
		found |= b->event[i].line;
	}
	CHECK_EQ(found, 3);
	for (unsigned i = 0; i < b->results; i++) {
		const struct sync0_result *r = &b->result[i];

		CHECK(r->missing == 0 || r->first_missing == (r->line == 0 ? 5000 : 5001));
	}
	bench_destroy(b);
}

TEST(sync0_cycles, a_slave_that_fires_in_every_cycle_instead_of_every_second_fails)
{
	struct bench *b = slow_and_fast();

	b->cycle_ns[0] = BENCH_PERIOD_NS;
	bench_start(b);
	bench_run(b, 3200);
	CHECK(b->results >= 4);
	CHECK_EQ(b->result[0].line, 0);
	CHECK(b->result[2].extra >= 498);
	CHECK_EQ(b->result[2].check[SYNC0_CHECK_COUNT], SYNC0_FAIL);
	CHECK_EQ(b->result[3].extra + b->result[3].missing, 0);
	bench_destroy(b);
}

TEST(sync0_cycles, a_slave_that_fires_once_in_a_cycle_instead_of_twice_fails)
{
	struct bench *b = slow_and_fast();

	b->cycle_ns[1] = BENCH_PERIOD_NS;
	bench_start(b);
	bench_run(b, 3200);
	CHECK(b->results >= 4);
	CHECK_EQ(b->result[3].missing, 1000);
	CHECK_EQ(b->result[3].check[SYNC0_CHECK_COUNT], SYNC0_FAIL);
	CHECK_EQ(b->result[2].verdict == SYNC0_FAIL, 0);
	bench_destroy(b);
}

/* The odd cycles instead of the even ones. */
TEST(sync0_cycles, a_slave_that_fires_in_the_wrong_one_of_two_cycles_fails)
{
	struct bench *b = slow_and_fast();

	b->line_ns[0] += BENCH_PERIOD_NS;
	bench_start(b);
	bench_run(b, 3200);
	CHECK(b->results >= 4);
	CHECK_EQ(b->result[2].missing, 0);
	CHECK_EQ(b->result[2].check[SYNC0_CHECK_PHASE], SYNC0_FAIL);
	bench_destroy(b);
}

static enum bench_fate fall_silent(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	(void)b;
	(void)edge;
	return line == 0 && cycle >= 3500 && cycle < 4500 ? BENCH_NO_PULSE : BENCH_GIVE;
}

TEST(sync0_cycles, a_slow_line_is_lost_after_the_time_for_that_and_back_with_the_next_pulses)
{
	struct bench *b = slow_and_fast();
	struct event ev;

	b->alter = fall_silent;
	bench_start(b);
	bench_run(b, 3595);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_LOST, NULL), 0);
	bench_run(b, 20);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_LOST, &ev), 1);
	CHECK_EQ(ev.value, 3500);
	CHECK_EQ(ev.line, 1);
	bench_run(b, 2000);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_BACK, &ev), 1);
	CHECK_EQ(ev.value, 4500);
	CHECK_EQ(ev.arg[0], 500);
	bench_destroy(b);
}

/* The master counts its cycles anew, odd ones become even: windows stay within their bounds. */
TEST(sync0_cycles, new_numbers_of_the_cycles_raise_no_alarm)
{
	struct bench *b = slow_and_fast();

	bench_start(b);
	bench_run(b, 3333);
	b->number_step = 7;
	bench_run(b, 6000);
	bench_show(b);
	CHECK_EQ(b->events, 0);
	CHECK(b->results >= 14);
	bench_destroy(b);
}

TEST(sync0_cycles, the_window_holds_enough_pulses_of_the_slowest_line)
{
	struct bench *b = slow_and_fast();

	b->spec.window_ns = 150 * BENCH_PERIOD_NS;
	CHECK_EQ(checker_fit_window(&b->spec), 1);
	CHECK_EQ(b->spec.window_ns, 100 * SLOW_NS);
	CHECK_EQ(checker_fit_window(&b->spec), 0);
	b->spec.line[1].cycle_ns = 100;
	CHECK_EQ(checker_create(&b->spec, &b->checker), -EINVAL);
	bench_destroy(b);
}
