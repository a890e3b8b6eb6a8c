/* SPDX-License-Identifier: MIT */
#include "sync0/judge.h"

#include "harness/test.h"
#include "sync0/alarm.h"

static const struct judge_limits limits = { .drift_ppb = 100000,
					    .rate_ppb = 10000,
					    .jitter_ns = 10000,
					    .phase_ns = 50000,
					    .skew_ns = 5000 };
static const struct judge_noise pi = {
	.is_known = 1, .sd_ns = 930, .p99_ns = 5200, .max_ns = 12900, .bias_error_ns = 100
};
static const struct judge_noise unknown = { .is_known = 0 };

static struct sync0_result good(void)
{
	return (struct sync0_result){
		.cycles = 1000,
		.edges = 1000,
		.jitter_p99_ns = 5200,
		.drift_ppb = 20000,
		.drift_error_ppb = 100,
		.rate_ppb = 10,
		.rate_error_ppb = 3000,
		.phase_ns = 2000,
		.phase_error_ns = 20000,
		.skew_ns = 40,
		.skew_error_ns = 120,
		.has = SYNC0_HAS_PERIOD | SYNC0_HAS_DRIFT | SYNC0_HAS_RATE | SYNC0_HAS_PHASE |
		       SYNC0_HAS_SKEW,
	};
}

TEST(sync0, a_good_window_on_a_calibrated_board_is_ok_and_its_small_figures_unresolved)
{
	struct sync0_result r = good();

	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.verdict, SYNC0_OK);
	CHECK_EQ(r.is_resolved, SYNC0_HAS_PERIOD | SYNC0_HAS_DRIFT);
}

TEST(sync0, without_a_calibration_phase_and_skew_are_unresolved_and_counts_are_judged)
{
	struct sync0_result r = good();

	judge(&limits, &unknown, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_COUNT], SYNC0_OK);
	CHECK_EQ(r.check[SYNC0_CHECK_PHASE], SYNC0_UNRESOLVED);
	CHECK_EQ(r.check[SYNC0_CHECK_SKEW], SYNC0_UNRESOLVED);
	CHECK_EQ(r.verdict, SYNC0_UNRESOLVED);
	CHECK_EQ(r.is_resolved & (SYNC0_HAS_JITTER | SYNC0_HAS_SKEW | SYNC0_HAS_PHASE), 0);
}

TEST(sync0, without_a_calibration_not_even_a_phase_far_off_fails)
{
	struct sync0_result r = good();

	r.phase_ns = 400000;
	judge(&limits, &unknown, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_PHASE], SYNC0_UNRESOLVED);
	r.step_ns = 400000;
	judge(&limits, &unknown, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_PHASE], SYNC0_WARN);
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_PHASE], SYNC0_FAIL);
	r = (struct sync0_result){ .kind = SYNC0_SHOT, .has_come = 1, .shot_late_ns = 400000 };
	judge(&limits, &unknown, 0, &r);
	CHECK_EQ(r.verdict, SYNC0_UNRESOLVED);
}

TEST(sync0, a_limit_below_the_noise_cannot_be_judged)
{
	struct judge_limits fine = limits;
	struct sync0_result r = good();

	fine.jitter_ns = 15; /* far below what a GPIO resolves */
	fine.skew_ns = 30;
	judge(&fine, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_JITTER], SYNC0_UNRESOLVED);
	CHECK_EQ(r.check[SYNC0_CHECK_SKEW], SYNC0_UNRESOLVED);
	CHECK_EQ(r.verdict, SYNC0_UNRESOLVED);
}

TEST(sync0, each_figure_beyond_its_limit_fails)
{
	struct sync0_result r = good();

	r.missing = 1;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_COUNT], SYNC0_FAIL);
	r = good();
	r.extra = 1;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_COUNT], SYNC0_WARN);
	r.extra = 11;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_COUNT], SYNC0_FAIL);
	r = good();
	r.rate_ppb = -50000;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_PERIOD], SYNC0_FAIL);
	r = good();
	r.drift_ppb = 150000;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_PERIOD], SYNC0_FAIL);
	r = good();
	r.jitter_p99_ns = 16000;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_JITTER], SYNC0_FAIL);
	r = good();
	r.phase_ns = -90000;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_PHASE], SYNC0_FAIL);
	r = good();
	r.skew_ns = 5300;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_SKEW], SYNC0_FAIL);
	CHECK_EQ(r.verdict, SYNC0_FAIL);
}

TEST(sync0, a_phase_that_was_asked_for_is_no_error)
{
	struct sync0_result r = good();

	r.phase_ns = 250000;
	judge(&limits, &pi, 250000, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_PHASE], SYNC0_OK);
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_PHASE], SYNC0_FAIL);
}

TEST(sync0, a_figure_near_its_limit_warns_or_is_unresolved_by_its_error)
{
	struct sync0_result r = good();

	r.skew_ns = 4500;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_SKEW], SYNC0_WARN);
	r.skew_ns = 4950;
	judge(&limits, &pi, 0, &r);
	CHECK_EQ(r.check[SYNC0_CHECK_SKEW], SYNC0_UNRESOLVED);
}

TEST(sync0, a_limit_of_zero_is_not_asked)
{
	const struct judge_limits none = { .drift_ppb = 0 };
	struct sync0_result r = good();

	r.phase_ns = 400000;
	r.skew_ns = 90000;
	judge(&none, &pi, 0, &r);
	CHECK_EQ(r.verdict, SYNC0_OK);
}

static unsigned reported;
static struct event newest;

static void keep(void *ctx, const struct event *ev)
{
	(void)ctx;
	reported++;
	newest = *ev;
}

static void window_with_skew(struct alarm_line *al, int64_t skew_ns)
{
	struct sync0_result r = good();

	r.skew_ns = skew_ns;
	r.slave_pos = 7;
	r.line = 4;
	judge(&limits, &pi, 0, &r);
	alarm_window(al, &r, &limits, keep, NULL);
}

TEST(sync0, an_alarm_is_raised_once_and_cleared_only_by_three_clearly_good_windows)
{
	struct alarm_line al = { .is_raised = { 0 } };

	reported = 0;
	window_with_skew(&al, 100);
	CHECK_EQ(reported, 0);
	window_with_skew(&al, 6000);
	CHECK_EQ(reported, 1);
	CHECK_EQ(newest.id, EVENT_SYNC0_SKEW);
	CHECK_EQ(newest.slave_pos, 7);
	CHECK_EQ(newest.line, 5);
	CHECK_EQ(newest.arg[0], 6000);
	CHECK_EQ(newest.arg[1], 5000);
	for (int i = 0; i < 10; i++) {
		window_with_skew(&al, i % 2 == 0 ? 4500 : 6000); /* about the limit */
	}
	CHECK_EQ(reported, 1);
	window_with_skew(&al, 100);
	window_with_skew(&al, 100);
	CHECK_EQ(reported, 1);
	window_with_skew(&al, 100);
	CHECK_EQ(reported, 2);
	CHECK_EQ(newest.id, EVENT_SYNC0_CLEAR);
	CHECK_EQ(newest.arg[0], SYNC0_CHECK_SKEW);
}
