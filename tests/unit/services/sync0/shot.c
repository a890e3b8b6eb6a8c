/* SPDX-License-Identifier: MIT */
/* One-shot mode: did the pulse come, when, and did one come that nobody had asked for? */
#include "harness/test.h"
#include "unit/services/sync0/bench.h"

static enum bench_fate only_shots(struct bench *b, unsigned line, int64_t cycle, struct edge *edge)
{
	(void)edge;
	if (line != 1) {
		return BENCH_GIVE;
	}
	if (b->line_ns[1] != 0 && cycle == 9000) {
		return BENCH_GIVE; /* nobody asked */
	}
	return cycle == 7000 ? BENCH_GIVE : BENCH_NO_PULSE;
}

static struct bench *with_shots(void)
{
	struct bench *b = bench_create();

	b->dc_ppm = 15;
	b->noise = BENCH_PI;
	b->spec.line[1].mode = CHECKER_ONESHOT;
	b->alter = only_shots;
	bench_start(b);
	return b;
}

static int64_t dc_of(int64_t cycle)
{
	return BENCH_DC0_NS + cycle * BENCH_PERIOD_NS;
}

TEST(sync0, a_commanded_shot_is_found_and_timed)
{
	struct bench *b = with_shots();
	struct event ev;
	const struct sync0_result *r = NULL;

	bench_run(b, 6900);
	CHECK_EQ(b->events, 0);
	checker_shot(b->checker, 1, dc_of(6900), dc_of(7000) - 3000);
	bench_run(b, 300);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_SHOT, &ev), 1);
	CHECK_EQ(ev.slave_pos, 3);
	CHECK_EQ(ev.value, dc_of(7000) - 3000);
	for (unsigned i = 0; i < b->results; i++) {
		r = b->result[i].kind == SYNC0_SHOT ? &b->result[i] : r;
	}
	CHECK(r != NULL);
	CHECK(r->has_come);
	CHECK(llabs(r->shot_late_ns - 3000) <= r->phase_error_ns + b->spec.noise.max_ns);
	CHECK_EQ(r->check[SYNC0_CHECK_COUNT], SYNC0_OK);
	CHECK_EQ(b->events, 1);
	bench_destroy(b);
}

TEST(sync0, a_shot_that_does_not_come_is_told_and_fails)
{
	struct bench *b = with_shots();
	struct event ev;

	bench_run(b, 5000);
	checker_shot(b->checker, 1, dc_of(5000), dc_of(5500));
	bench_run(b, 600);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_SHOT_LOST, &ev), 1);
	CHECK_EQ(ev.value, dc_of(5500));
	CHECK_EQ(ev.slave_pos, 3);
	CHECK_EQ(b->result[b->results - 1].kind, SYNC0_SHOT);
	CHECK_EQ(b->result[b->results - 1].verdict, SYNC0_FAIL);
	CHECK_EQ(checker_alarms(b->checker), 1);
	bench_destroy(b);
}

TEST(sync0, a_shot_that_nobody_asked_for_is_extra)
{
	struct bench *b = with_shots();
	struct event ev;

	b->line_ns[1] = 1;
	checker_shot(b->checker, 1, dc_of(0), dc_of(7000));
	bench_run(b, 10500);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_SHOT, NULL), 1);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_EXTRA, &ev), 1);
	CHECK_EQ(ev.value, 9000);
	CHECK_EQ(b->events, 2);
	bench_destroy(b);
}

TEST(sync0, a_shot_that_another_time_has_withdrawn_is_not_missed)
{
	struct bench *b = with_shots();
	struct event ev;

	bench_run(b, 5000);
	checker_shot(b->checker, 1, dc_of(5000), dc_of(6000));
	bench_run(b, 500);
	checker_shot(b->checker, 1, dc_of(5500), dc_of(7000));
	bench_run(b, 2000);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_SHOT, &ev), 1);
	CHECK_EQ(ev.value, dc_of(7000));
	checker_shot(b->checker, 1, dc_of(7500), dc_of(8000));
	checker_shot(b->checker, 1, dc_of(7600), 0);
	bench_run(b, 2000);
	CHECK_EQ(b->events, 1);
	bench_destroy(b);
}

TEST(sync0, a_shot_that_was_withdrawn_too_late_came_all_the_same)
{
	struct bench *b = with_shots();
	struct event ev;

	bench_run(b, 6900);
	checker_shot(b->checker, 1, dc_of(6900), dc_of(7000));
	checker_shot(b->checker, 1, dc_of(6999), dc_of(7000) + BENCH_PERIOD_NS / 2);
	bench_run(b, 2000);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_SHOT, &ev), 1);
	CHECK_EQ(ev.value, dc_of(7000));
	CHECK_EQ(bench_count(b, EVENT_SYNC0_SHOT_LOST, &ev), 1);
	CHECK_EQ(ev.value, dc_of(7000) + BENCH_PERIOD_NS / 2);
	CHECK_EQ(b->events, 2);
	bench_destroy(b);
}

TEST(sync0, a_shot_that_is_armed_anew_for_the_same_time_is_one_shot)
{
	struct bench *b = with_shots();

	bench_run(b, 6000);
	checker_shot(b->checker, 1, dc_of(6000), dc_of(7000));
	checker_shot(b->checker, 1, dc_of(6100), dc_of(8000));
	checker_shot(b->checker, 1, dc_of(6200), dc_of(7000));
	bench_run(b, 3000);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_SHOT, NULL), 1);
	CHECK_EQ(b->events, 1);
	bench_destroy(b);
}

TEST(sync0, a_shot_before_the_check_began_is_not_missed)
{
	struct bench *b = bench_create();

	b->spec.line[1].mode = CHECKER_ONESHOT;
	b->spec.since_ns = BENCH_MONO0_NS + 5000 * BENCH_PERIOD_NS;
	b->alter = only_shots;
	bench_start(b);
	checker_shot(b->checker, 1, dc_of(1000), dc_of(2000));
	checker_shot(b->checker, 1, dc_of(2100), dc_of(7000));
	bench_run(b, 8000);
	CHECK_EQ(bench_count(b, EVENT_SYNC0_SHOT, NULL), 1);
	CHECK_EQ(b->events, 1);
	bench_destroy(b);
}
