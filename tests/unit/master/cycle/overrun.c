/* SPDX-License-Identifier: MIT */
/* A late master: numbers, deadline, the samples of skipped edges, and cycle.overrun. */
#include <errno.h>
#include <stdlib.h>

#include "harness/test.h"
#include "unit/master/cycle/bench.h"

TEST(cycle, a_wake_three_periods_late_leaves_three_skipped_samples_and_keeps_the_phase)
{
	uint64_t cycle;

	start_in_op();
	steps(1);
	cycle = next_sample().h.cycle;
	world.late_ns = 3 * PERIOD_NS + 100000;
	steps(3);
	for (unsigned i = 1; i <= 6; i++) {
		struct got s = next_sample();

		CHECK_EQ(s.h.cycle, cycle + i);
		CHECK_EQ((s.h.flags & SAMPLE_SKIPPED) != 0, i <= 3);
		CHECK_EQ(s.h.slaves_bad.word[0], i <= 3 ? 3 : 0);
	}
	CHECK_EQ(stats.overruns, 1);
	CHECK_EQ(stats.cycles_skipped, 3);
	CHECK_EQ(stats.samples_bad, 6);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
}

TEST(cycle, a_stall_too_long_for_placeholders_jumps_the_numbers_by_exactly_the_stall)
{
	uint64_t cycle;

	start_in_op();
	steps(1);
	cycle = next_sample().h.cycle;
	world.late_ns = 5000 * (int64_t)PERIOD_NS;
	steps(2);
	CHECK_EQ(next_sample().h.cycle, cycle + 5001);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
	check_event(next_event(EVENT_NUMBERING_JUMP), EVENT_NO_SLAVE, (int64_t)cycle + 5001, 5000,
		    0);
	CHECK_EQ(count_events(EVENT_NUMBERING_JUMP), 0);
}

TEST(cycle, the_overrun_policy_counts_in_op_only)
{
	cfg.cycle_overrun = CONFIG_OVERRUN_FAIL_SAFE;
	start();
	world.late_ns = 3 * PERIOD_NS;
	steps(500);
	cycle_phase_set(cy, CYCLE_OP);
	set_led(1);
	steps(3);
	CHECK_EQ(world.seen_output & 1, 1);
	world.late_ns = 3 * PERIOD_NS;
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
	CHECK_EQ(count_events(EVENT_OUTPUT_FAIL_SAFE), 1);
	cfg.cycle_overrun = CONFIG_OVERRUN_COUNT;
}

TEST(cycle, a_late_frame_goes_out_before_the_skipped_samples_are_written)
{
	uint64_t newest;

	start_in_op();
	newest = ring_newest(reader);
	world.late_ns = 500 * (int64_t)PERIOD_NS;
	steps(1);
	CHECK_EQ(world.written, newest);
	CHECK_EQ(ring_newest(reader), newest + 501);
	for (unsigned i = 0; i < 501; i++) {
		struct got s = next_sample();

		CHECK_EQ(s.h.flags & SAMPLE_SKIPPED, i < 500 ? SAMPLE_SKIPPED : 0);
		CHECK_EQ(s.h.round_trip_ns, i < 500 ? -1 : world.transit_ns);
	}
}

TEST(cycle, an_overrun_with_policy_stop_sends_fail_safe_values_before_the_end)
{
	unsigned safe = 0;
	int r;

	cfg.cycle_overrun = CONFIG_OVERRUN_STOP;
	start_in_op();
	set_led(1);
	steps(3);
	CHECK_EQ(world.seen_output & 1, 1);
	world.late_ns = 3 * PERIOD_NS;
	steps(1);
	while (!cycle_has_stopped(cy, &r)) {
		world.late_ns = 2 * PERIOD_NS; /* and it goes on being late */
		steps(1);
		CHECK_EQ(world.seen_output & 1, 0);
		CHECK(++safe < 100);
	}
	CHECK_EQ(safe, 4);
	CHECK_EQ(r, -ETIME);
	cfg.cycle_overrun = CONFIG_OVERRUN_COUNT;
}

TEST(cycle, a_stall_found_at_the_wake_and_again_by_the_frame_is_one_overrun)
{
	start_in_op();
	world.late_ns = 2 * PERIOD_NS + 400000;
	world.transit_ns = 200000;
	steps(1);
	world.transit_ns = 20000;
	CHECK_EQ(stats.overruns, 1);
	CHECK_EQ(stats.cycles_skipped, 3);
	steps(3);
	CHECK_EQ(stats.overruns, 1);
}

TEST(cycle, a_late_frame_that_is_held_past_the_next_edge_moves_the_deadline_with_the_number)
{
	start_in_op();
	world.late_ns = 2 * PERIOD_NS + 480000;
	world.hold_ns = 100000;
	steps(1);
	CHECK_EQ(stats.cycles_skipped, 3);
	CHECK_EQ(stats.overruns, 1);
	steps(200);
	CHECK_EQ(stats.cycles_skipped, 3);
	CHECK_EQ(stats.frames_late, 0);
	CHECK_EQ(stats.samples_bad, 2 * 3);
}

TEST(cycle, a_number_behind_the_edges_is_corrected_once_and_the_deadline_stays)
{
	uint64_t cycle;

	start_in_op();
	steps(1);
	cycle = next_sample().h.cycle;
	world.dc_offset_ns += PERIOD_NS; /* one edge on, in the same phase: this master was not late
					  */
	steps(50);
	CHECK_EQ(stats.overruns, 1);
	CHECK_EQ(stats.cycles_skipped, 1);
	for (unsigned i = 1; i <= 51; i++) {
		struct got s = next_sample();

		CHECK_EQ(s.h.cycle, cycle + i);
		CHECK_EQ((s.h.flags & SAMPLE_SKIPPED) != 0, i == 1);
		CHECK_EQ(s.h.slaves_bad.word[0], i == 1 ? 3 : 0);
	}
	CHECK_EQ(stats.samples_bad, 2);
}

TEST(cycle, a_number_behind_by_three_edges_and_a_wake_late_by_two_are_corrected_together)
{
	int64_t step_ns;
	uint64_t skipped;

	start_in_op();
	world.dc_offset_ns += 3 * PERIOD_NS;
	world.late_ns = 2 * PERIOD_NS;
	steps(1);
	skipped = stats.cycles_skipped;
	CHECK_EQ(skipped, 5);
	CHECK_EQ(stats.overruns, 1);
	step_ns = world.now.ns;
	steps(20);
	CHECK_EQ(stats.cycles_skipped, skipped);
	CHECK(llabs(world.now.ns - step_ns - 20 * (int64_t)PERIOD_NS) < 100000);
}

/* Master and slaves were delayed together: the frame is back, its time too far off to be plausible.
 */
TEST(cycle, a_frame_without_a_time_is_late_and_never_taken_for_the_current_one)
{
	start_in_op();
	steps(10);
	world.is_timeless = 1;
	world.late_ns = 22 * PERIOD_NS + 40000;
	world.dc_offset_ns += 3 * PERIOD_NS;
	steps(1);
	world.is_timeless = 0;
	steps(20);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
	CHECK_EQ(stats.frames_late, 1);
	CHECK(stats.samples_bad > 0);
	CHECK_EQ(stats.samples_good, 2 * (10 + 10 + 20));
}
