/* SPDX-License-Identifier: MIT */
/* Streams of known truth: each trouble is found, with its slave, cycle and size. */
#include "sync0/checker.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "harness/test.h"
#include "unit/services/sync0/bench.h"

static struct bench *noisy(void)
{
	struct bench *b = bench_create();

	b->noise = BENCH_PI;
	b->dc_ppm = 37;
	return b;
}

TEST(sync0, the_noise_of_these_tests_is_that_of_a_pi)
{
	struct bench *b = noisy();
	const struct sync0_result *r;

	b->dc_ppm = 0;
	b->spec.window_ns = 100000 * BENCH_PERIOD_NS;
	bench_start(b);
	bench_run(b, 102000);
	CHECK(b->results == 2);
	r = &b->result[0];
	printf("sd %.0f ns, p50 %lld, p99 %lld, max %lld ns\n", r->period_sd_ns,
	       (long long)r->jitter_p50_ns, (long long)r->jitter_p99_ns,
	       (long long)r->jitter_max_ns);
	CHECK(r->period_sd_ns > 850 && r->period_sd_ns < 1010);
	CHECK(r->jitter_p50_ns >= 25 && r->jitter_p50_ns <= 60);
	CHECK(r->jitter_p99_ns > 4800 && r->jitter_p99_ns < 5800);
	CHECK(r->jitter_max_ns > 9000 && r->jitter_max_ns <= 14000);
	bench_destroy(b);
}

TEST(sync0, clean_edges_raise_nothing_and_the_figures_are_true)
{
	struct bench *b = noisy();

	bench_start(b);
	bench_run(b, 20200);
	CHECK(b->results >= 38);
	if (b->events != 0) {
		bench_show(b);
	}
	CHECK_EQ(b->events, 0);
	for (unsigned i = 0; i < b->results; i++) {
		const struct sync0_result *r = &b->result[i];

		CHECK_EQ(r->edges, 1000);
		CHECK_EQ(r->cycles, 1000);
		CHECK_EQ(r->missing + r->extra + r->overflow, 0);
		CHECK_EQ(r->slave_pos, r->line == 0 ? 0 : 3);
		CHECK(fabs(r->drift_ppb - 37000) <= r->drift_error_ppb);
		CHECK(r->drift_error_ppb < 300);
		CHECK(fabs(r->rate_ppb) <= r->rate_error_ppb);
		CHECK(llabs(r->phase_ns) <= r->phase_error_ns);
		CHECK(llabs(r->frame_ns - BENCH_PERIOD_NS / 2) < 5000);
		CHECK_EQ(r->dc_diff_ns, 12);
		CHECK(r->line == 0 || llabs(r->skew_ns) <= r->skew_error_ns);
		CHECK(r->line == 0 || r->skew_error_ns < 50);
	}
	bench_destroy(b);
}

static enum bench_fate drop_some(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	(void)b;
	(void)edge;
	return line == 1 && (cycle == 5000 || (cycle >= 7990 && cycle < 8010)) ? BENCH_NO_PULSE
									       : BENCH_GIVE;
}

TEST(sync0, missing_pulses_are_told_with_slave_and_cycle)
{
	struct bench *b = noisy();
	struct event ev;

	b->alter = drop_some;
	bench_start(b);
	bench_run(b, 10200);
	CHECK_EQ(bench_missing(b, 0), 0);
	CHECK_EQ(bench_missing(b, 1), 21);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_MISSING, &ev) >= 2, 1);
	CHECK_EQ(ev.value, 5000);
	CHECK_EQ(ev.slave_pos, 3);
	CHECK_EQ(ev.line, 2);
	CHECK_EQ(ev.arg[0], 1);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_EXTRA, NULL), 0);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_LOST, NULL), 0);
	for (unsigned i = 0; i < b->results; i++) {
		CHECK_EQ(b->result[i].verdict == SYNC0_FAIL, b->result[i].missing > 0);
	}
	bench_destroy(b);
}

static enum bench_fate drop_long(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	(void)b;
	(void)edge;
	return line == 0 && cycle >= 3500 && cycle < 5700 ? BENCH_NO_PULSE : BENCH_GIVE;
}

TEST(sync0, a_line_that_falls_silent_is_lost_at_once_and_back_once)
{
	struct bench *b = noisy();
	struct event ev;

	b->alter = drop_long;
	bench_start(b);
	bench_run(b, 3650);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_LOST, &ev), 1);
	CHECK_EQ(ev.value, 3500);
	CHECK_EQ(ev.slave_pos, 0);
	CHECK(checker_is_lost(b->checker, 0));
	CHECK(!checker_is_lost(b->checker, 1));
	bench_run(b, 4550);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_LOST, NULL), 1);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_BACK, &ev), 1);
	CHECK_EQ(ev.value, 5700);
	CHECK_EQ(ev.arg[0], 2200);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_MISSING, NULL), 0);
	CHECK_EQ(bench_missing(b, 0), 2200);
	CHECK(!checker_is_lost(b->checker, 0));
	bench_destroy(b);
}

static enum bench_fate drop_all(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	(void)b;
	(void)cycle;
	(void)edge;
	return line == 0 ? BENCH_GIVE : BENCH_NO_PULSE;
}

TEST(sync0, a_line_that_never_had_an_edge_is_lost)
{
	struct bench *b = noisy();
	struct event ev;

	b->alter = drop_all;
	bench_start(b);
	bench_run(b, 1200);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_LOST, &ev), 1);
	CHECK_EQ(ev.line, 2);
	CHECK_EQ(b->result[1].edges, 0);
	CHECK_EQ(b->result[1].verdict, SYNC0_FAIL);
	bench_destroy(b);
}

static enum bench_fate add_extra(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	struct edge extra = *edge;

	if (line == 1 && (cycle == 2500 || cycle == 6300)) {
		checker_edge(b->checker, edge);
		extra.mono_ns += cycle == 2500 ? 300000 : 620000;
		extra.seqno++;
		*edge = extra;
	}
	return BENCH_GIVE;
}

TEST(sync0, extra_pulses_are_counted_and_no_cycle_is_lost_by_them)
{
	struct bench *b = noisy();
	struct event ev;

	b->alter = add_extra;
	bench_start(b);
	bench_run(b, 8200);
	CHECK_EQ(bench_extra(b, 1), 2);
	CHECK_EQ(bench_extra(b, 0), 0);
	CHECK_EQ(bench_missing(b, 1), 0);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_EXTRA, &ev), 2);
	CHECK_EQ(ev.value, 2500);
	CHECK_EQ(ev.slave_pos, 3);
	bench_destroy(b);
}

static enum bench_fate overflow(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	(void)b;
	(void)edge;
	/* The edges came, their numbers were given, and the reader was too slow for them. */
	return line == 0 && cycle >= 4100 && cycle < 4140 ? BENCH_DROP : BENCH_GIVE;
}

static enum bench_fate overflow_and_missing(struct bench *b, unsigned line, int64_t cycle,
					    struct edge *edge)
{
	if (line == 0 && cycle >= 4200 && cycle < 4203) {
		return BENCH_NO_PULSE;
	}
	return overflow(b, line, cycle, edge);
}

TEST(sync0, a_queue_that_ran_over_is_told_apart_from_missing_pulses)
{
	struct bench *b = noisy();
	struct event ev;

	b->alter = overflow_and_missing;
	bench_start(b);
	bench_run(b, 6200);
	CHECK_EQ(bench_missing(b, 0), 3);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_MISSING, &ev), 1);
	CHECK_EQ(ev.value, 4200);
	CHECK_EQ(ev.arg[0], 3);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_OVERFLOW, &ev), 1);
	CHECK_EQ(ev.arg[0], 40);
	bench_destroy(b);
}

TEST(sync0, an_overflow_alone_is_a_warning)
{
	struct bench *b = noisy();

	b->alter = overflow;
	bench_start(b);
	bench_run(b, 6200);
	CHECK_EQ(bench_missing(b, 0), 0);
	for (unsigned i = 0; i < b->results; i++) {
		const struct sync0_result *r = &b->result[i];

		CHECK_EQ(r->check[SYNC0_CHECK_COUNT], r->overflow > 0 ? SYNC0_WARN : SYNC0_OK);
		CHECK_EQ(r->edges + r->overflow, r->cycles);
	}
	bench_destroy(b);
}

static enum bench_fate one_dropped(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	(void)b;
	(void)edge;
	return line == 1 && cycle == 4100 ? BENCH_DROP : BENCH_GIVE;
}

TEST(sync0, one_edge_dropped_by_the_kernel_is_reported)
{
	struct bench *b = noisy();
	struct event ev;

	b->alter = one_dropped;
	bench_start(b);
	bench_run(b, 6200);
	CHECK_EQ(bench_missing(b, 1), 0);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_OVERFLOW, &ev), 1);
	CHECK_EQ(ev.arg[0], 1);
	CHECK(ev.value <= 4100 && ev.value > 4100 - 1000);
	bench_destroy(b);
}

TEST(sync0, a_period_that_is_off_by_50_ppm_is_found_and_measured)
{
	struct bench *b = noisy();
	struct event ev;
	const struct sync0_result *last;

	b->line_ppm[1] = -50; /* its SYNC0 is slow */
	bench_start(b);
	bench_run(b, 12200);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_PERIOD, &ev), 1);
	CHECK_EQ(ev.slave_pos, 3);
	CHECK(abs(ev.arg[0] + 50000) < 6000);
	last = &b->result[b->results - 1];
	printf("rate %.0f +- %.0f ppb, drift %.0f +- %.0f ppb\n", last->rate_ppb,
	       last->rate_error_ppb, last->drift_ppb, last->drift_error_ppb);
	CHECK_EQ(last->line, 1);
	CHECK(fabs(last->rate_ppb + 50000) <= last->rate_error_ppb);
	CHECK(last->rate_error_ppb < 13000);
	CHECK(fabs(last->drift_ppb - (37000 - 50000)) <= last->drift_error_ppb + 5);
	CHECK_EQ(last->check[SYNC0_CHECK_PERIOD], SYNC0_FAIL);
	CHECK_EQ(last[-1].check[SYNC0_CHECK_PERIOD], SYNC0_OK);
	bench_destroy(b);
}

TEST(sync0, a_skew_of_3_us_is_found_and_measured)
{
	struct bench *b = noisy();
	struct event ev;

	b->line_ns[1] = 3000;
	bench_start(b);
	bench_run(b, 4200);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_SKEW, &ev), 1);
	CHECK_EQ(ev.slave_pos, 3);
	CHECK(abs(ev.arg[0] - 3000) < 30);
	for (unsigned i = 0; i < b->results; i++) {
		const struct sync0_result *r = &b->result[i];

		CHECK_EQ(r->check[SYNC0_CHECK_SKEW], r->line == 1 ? SYNC0_FAIL : SYNC0_NONE);
		CHECK(r->line == 0 || llabs(r->skew_ns - 3000) <= r->skew_error_ns);
	}
	bench_destroy(b);
}

TEST(sync0, a_skew_that_was_asked_for_is_none)
{
	struct bench *b = noisy();

	b->line_ns[1] = 3000;
	b->spec.line[1].shift_ns = 3000;
	bench_start(b);
	bench_run(b, 4200);
	CHECK_EQ(b->events, 0);
	bench_destroy(b);
}

static enum bench_fate step_line(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	if (line == 1 && cycle == 3400) {
		b->line_ns[1] = 120000;
		edge->mono_ns += 120000;
	}
	if (line == 1 && cycle == 5400) {
		b->line_ns[1] = 500000;
		edge->mono_ns += 380000;
	}
	return BENCH_GIVE;
}

TEST(sync0, a_phase_that_steps_is_found_with_its_cycle_and_size)
{
	struct bench *b = noisy();
	struct event ev;

	b->alter = step_line;
	bench_start(b);
	bench_run(b, 5000);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_PHASE_STEP, &ev), 1);
	CHECK_EQ(ev.slave_pos, 3);
	CHECK_EQ(ev.value, 3400);
	CHECK(abs(ev.arg[0] - 120000) < 15000);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_PHASE, NULL), 1);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_MISSING, NULL), 0);
	bench_run(b, 2200);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_PHASE_STEP, NULL), 2);
	CHECK_EQ(b->event[b->events - 1].value, 5400);
	CHECK(abs(b->event[b->events - 1].arg[0] - 380000) < 15000);
	CHECK_EQ(bench_missing(b, 1) + bench_extra(b, 1), 0);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_CLOCK_STEP, NULL), 0);
	bench_destroy(b);
}

static enum bench_fate step_host(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	if (line == 0 && cycle == 3400 && b->host_step_ns == 0) {
		b->host_step_ns = 2370000;
		edge->mono_ns += b->host_step_ns;
	}
	if (line == 0 && cycle == 6700 && b->host_step_ns > 0) {
		edge->mono_ns -= b->host_step_ns + 41000000;
		b->host_step_ns = -41000000;
	}
	return BENCH_GIVE;
}

TEST(sync0, a_clock_that_steps_is_told_as_that_and_no_slave_is_blamed)
{
	struct bench *b = noisy();
	struct event ev;

	b->alter = step_host;
	bench_start(b);
	bench_run(b, 10200);
	if (b->events != 2) {
		bench_show(b);
	}
	CHECK_EQ(bench_count(b, EVENT_SYNC0_CLOCK_STEP, &ev), 2);
	CHECK(abs(ev.arg[0] - 2370000) < 30000);
	CHECK(llabs(ev.value - 3400) < 30);
	CHECK_EQ(ev.slave_pos, EVENT_NO_SLAVE);
	CHECK(abs(b->event[1].arg[0] + 43370000) < 30000);
	CHECK_EQ(b->events, 2);
	for (unsigned i = 0; i < b->results; i++) {
		CHECK(b->result[i].verdict != SYNC0_FAIL);
	}
	CHECK_EQ(b->result[b->results - 1].verdict, SYNC0_OK);
	CHECK_EQ(b->result[b->results - 1].edges, 1000);
	bench_destroy(b);
}

TEST(sync0, cycles_that_are_numbered_anew_are_no_clock_that_stepped)
{
	struct bench *b = noisy();

	bench_start(b);
	bench_run(b, 3500);
	b->number_step = 1;
	bench_run(b, 6700);
	if (b->events != 0) {
		bench_show(b);
	}
	CHECK_EQ(b->events, 0);
	for (unsigned i = 0; i < b->results; i++) {
		CHECK(b->result[i].verdict != SYNC0_FAIL);
	}
	CHECK_EQ(b->result[b->results - 1].verdict, SYNC0_OK);
	CHECK_EQ(b->result[b->results - 1].edges, 1000);
	CHECK(llabs(b->result[b->results - 1].phase_ns) <=
	      b->result[b->results - 1].phase_error_ns);
	bench_destroy(b);
}

TEST(sync0, edges_alone_are_counted_without_a_master)
{
	struct bench *b = noisy();
	struct event ev;

	b->spec.grid = CHECKER_GRID_EDGES;
	b->alter = drop_some;
	bench_start(b);
	bench_run(b, 10200);
	CHECK_EQ(bench_missing(b, 0), 0);
	CHECK_EQ(bench_missing(b, 1), 21);
	CHECK(bench_count(b, EVENT_SYNC0_MISSING, &ev) >= 2);
	CHECK_EQ(ev.value, 5000);
	for (unsigned i = 0; i < b->results; i++) {
		CHECK_EQ(b->result[i].has & (SYNC0_HAS_PHASE | SYNC0_HAS_RATE), 0);
		CHECK(fabs(b->result[i].drift_ppb - 37000) <= b->result[i].drift_error_ppb);
	}
	bench_destroy(b);
}

TEST(sync0, a_host_clock_that_steps_is_found_by_edges_alone)
{
	struct bench *b = noisy();

	b->spec.grid = CHECKER_GRID_EDGES;
	b->alter = step_host;
	bench_start(b);
	bench_run(b, 6200);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_CLOCK_STEP, NULL), 1);
	CHECK_EQ(b->result[b->results - 1].edges, 1000);
	bench_destroy(b);
}

TEST(sync0, cycles_that_nobody_could_hear_are_not_judged)
{
	struct bench *b = noisy();

	b->spec.since_ns = BENCH_MONO0_NS + 2500 * BENCH_PERIOD_NS;
	b->alter = drop_all;
	bench_start(b);
	bench_run(b, 2550);
	CHECK_EQ(b->events, 0);
	CHECK_EQ(b->results, 0);
	bench_run(b, 1200);
	CHECK(b->result[0].first_cycle > 2500 && b->result[0].first_cycle < 2510);
	bench_destroy(b);
}

TEST(sync0, a_spec_that_makes_no_sense_is_refused)
{
	struct bench *b = bench_create();
	struct checker *ck = NULL;

	b->spec.line_count = 0;
	CHECK_EQ(checker_create(&b->spec, &ck), -EINVAL);
	b->spec.line_count = 1;
	b->spec.window_ns = 3 * BENCH_PERIOD_NS;
	CHECK_EQ(checker_create(&b->spec, &ck), -EINVAL);
	b->spec.window_ns = 1000 * BENCH_PERIOD_NS;
	b->spec.period_ns = 0;
	CHECK_EQ(checker_create(&b->spec, &ck), -EINVAL);
	CHECK(ck == NULL);
	bench_destroy(b);
}
