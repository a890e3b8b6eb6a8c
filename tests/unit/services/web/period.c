/* SPDX-License-Identifier: MIT */
#include "web/period.h"

#include <math.h>

#include "harness/test.h"

#define TAU 6.283185307179586

static double sine(uint64_t cycle, double period)
{
	return 3 + 0.5 * sin(TAU * (double)cycle / period);
}

TEST(period, that_of_a_sine_is_exact_to_a_part_of_a_sample)
{
	struct period p;

	for (double period = 7.3; period < 900; period *= 1.9) {
		period_begin(&p, 3, 2.5, 3.5);
		for (uint64_t cycle = 5000; cycle < 7000; cycle++) {
			period_add(&p, cycle, sine(cycle, period));
		}
		CHECK(fabs(period_cycles(&p) / period - 1) < 2e-4);
	}
}

TEST(period, noise_at_the_mean_is_not_counted)
{
	struct period p;

	period_begin(&p, 3, 2.5, 3.5);
	for (uint64_t cycle = 0; cycle < 5000; cycle++) {
		period_add(&p, cycle, sine(cycle, 1000) + (cycle % 2 == 0 ? 0.03 : -0.03));
	}
	CHECK(fabs(period_cycles(&p) - 1000) < 20);
}

TEST(period, across_a_gap_nothing_is_counted)
{
	struct period p;

	period_begin(&p, 3, 2.5, 3.5);
	for (uint64_t cycle = 0; cycle < 5000; cycle++) {
		if (cycle < 2600 || cycle > 2637) {
			period_add(&p, cycle, cycle == 1700 ? (double)NAN : sine(cycle, 400));
		}
	}
	CHECK(fabs(period_cycles(&p) / 400 - 1) < 1e-3);
}

TEST(period, less_than_one_period_and_a_constant_have_none)
{
	struct period p;

	period_begin(&p, 3, 2.5, 3.5);
	for (uint64_t cycle = 0; cycle < 900; cycle++) {
		period_add(&p, cycle, sine(cycle, 1000));
	}
	CHECK(isnan(period_cycles(&p)));
	period_begin(&p, 3, 3, 3);
	for (uint64_t cycle = 0; cycle < 900; cycle++) {
		period_add(&p, cycle, 3);
	}
	CHECK(isnan(period_cycles(&p)));
}
