/* SPDX-License-Identifier: MIT */
/* Which slaves are live. */
#include "harness/test.h"
#include "unit/master/cycle/bench.h"
#include "wire/al.h"

TEST(cycle, of_a_split_image_only_the_slave_that_is_not_there_is_bad)
{
	struct got s;

	start_in_op();
	plan.is_split = 1;
	set_led(1);
	world.status = EXCHANGE_WKC_LOW;
	world.slaves_low = 2;
	steps(10);
	CHECK_EQ(stats.slave_bad[0], 0);
	CHECK_EQ(stats.slave_bad[1], 10);
	CHECK_EQ(stats.samples_bad, 10);
	s = next_sample();
	CHECK_EQ(s.h.slaves_bad.word[0], 2);
	CHECK_EQ(s.h.flags & SAMPLE_WKC_LOW, SAMPLE_WKC_LOW);
	cycle_slaves_set(cy, &(struct slave_set){ { 1 } }, cycle_alerts(cy)); /* the service thread
										 knows now */
	steps(100);
	CHECK_EQ(stats.slave_bad[0], 0);
	CHECK_EQ(stats.slave_bad[1], 10);
	CHECK_EQ(stats.slave_good[0], stats.slave_good[1] + 110);
	CHECK_EQ(world.seen_output & 1, 1);
	CHECK_EQ(stats.is_fail_safe, 0);
	world.status = EXCHANGE_OK;
	world.slaves_low = 0;
	cycle_slaves_set(cy, &(struct slave_set){ { 3 } }, cycle_alerts(cy)); /* and it is back, its
									       * counter anywhere
									       */
	steps(100);
	CHECK_EQ(stats.samples_bad, 11); /* its first, which nothing can be compared with */
	CHECK_EQ(stats.slave_bad[0], 0);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
	ring_seek(reader, ring_newest(reader));
	steps(1);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
}

TEST(cycle, a_frame_outside_its_window_is_late_though_a_slave_of_a_split_image_is_missing)
{
	uint64_t unexplained;
	struct got s;

	start_in_op();
	plan.is_split = 1;
	world.status = EXCHANGE_WKC_LOW;
	world.slaves_low = 2;
	steps(10);
	CHECK_EQ(stats.frames_late, 0);
	ring_seek(reader, ring_newest(reader));
	CHECK_EQ(stats.slave_bad[0], 0);
	unexplained = stats.samples_bad_unexplained;
	/* The frame is back, its DC time not plausible. */
	world.is_timeless = 1;
	steps(1);
	world.is_timeless = 0;
	CHECK_EQ(stats.frames_late, 1);
	CHECK_EQ(stats.slave_bad[0], 1);
	CHECK_EQ(stats.samples_bad_unexplained, unexplained);
	s = next_sample();
	CHECK_EQ(s.h.flags & SAMPLE_LATE, SAMPLE_LATE);
	CHECK_EQ(s.h.slaves_bad.word[0], 3);
}

/* Of an image in two datagrams, with an output that is on. */
static void start_split_in_op(void)
{
	start_in_op();
	plan.is_split = 1;
	set_led(1);
	steps(3);
}

TEST(cycle, outputs_of_a_slave_that_is_not_in_op_are_at_fail_safe)
{
	start_split_in_op();
	CHECK_EQ(world.seen_output & 1, 1);
	cycle_slaves_set(cy, &(struct slave_set){ { 2 } }, cycle_alerts(cy));
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
	cycle_slaves_set(cy, &(struct slave_set){ { 3 } }, cycle_alerts(cy));
	steps(2);
	CHECK_EQ(world.seen_output & 1, 1);
}

/* One step with a frame like that: the sample is not good, and the next frame's outputs are safe.
 */
static void check_leaves_op(uint16_t al_status, uint16_t al_wkc)
{
	uint64_t alerts;

	start_in_op();
	set_led(1);
	steps(3);
	CHECK_EQ(world.seen_output & 1, 1);
	alerts = cycle_alerts(cy);
	ring_seek(reader, ring_newest(reader));
	world.al_status = al_status;
	world.al_wkc = al_wkc;
	steps(1);
	CHECK_EQ(world.seen_output & 1, 1);
	CHECK(cycle_alerts(cy) > alerts);
	CHECK_EQ(next_sample().h.flags & (SAMPLE_NOT_OP | SAMPLE_FAIL_SAFE), SAMPLE_NOT_OP);
	steps(1);
	CHECK_EQ(world.seen_output & 1, 0);
	CHECK_EQ(next_sample().h.flags & (SAMPLE_NOT_OP | SAMPLE_FAIL_SAFE),
		 SAMPLE_NOT_OP | SAMPLE_FAIL_SAFE);
	CHECK_EQ(stats.op_lost, 1);
	CHECK_EQ(stats.is_fail_safe, 1);
	CHECK_EQ(stats.samples_bad, 0);
}

TEST(cycle_slaves, any_state_but_op_without_error_of_all_slaves_ends_live_outputs)
{
	check_leaves_op(AL_OP | AL_SAFEOP | AL_ERROR, 2);
	check_event(next_event(EVENT_OP_LOST), EVENT_NO_SLAVE, (int64_t)stats.cycle_number - 1,
		    AL_OP | AL_SAFEOP | AL_ERROR, 2);
	check_leaves_op(AL_OP | AL_ERROR, 2);
	check_leaves_op(AL_OP | AL_INIT, 2);
	check_leaves_op(AL_SAFEOP, 2);
	check_leaves_op(0, 2);
}

TEST(cycle_slaves, a_slave_that_does_not_answer_ends_live_outputs)
{
	check_leaves_op(AL_OP, 1);
	check_event(next_event(EVENT_SLAVE_COUNT), EVENT_NO_SLAVE, (int64_t)stats.cycle_number - 1,
		    1, 2);
	CHECK_EQ(stats.slaves_found, 1);
}

TEST(cycle_slaves, an_identification_request_is_no_state)
{
	start_in_op();
	world.al_status = AL_OP | AL_ID_REQUEST;
	steps(10);
	CHECK_EQ(stats.op_lost, 0);
	CHECK_EQ(stats.samples_good, 40);
}

TEST(cycle_slaves, a_lost_frame_and_no_monitor_say_nothing_about_states)
{
	start_in_op();
	world.al_status = 0;
	world.al_wkc = 0;
	world.status = EXCHANGE_NO_FRAME;
	steps(10);
	CHECK_EQ(stats.op_lost, 0);
	start();
	plan.monitor = 0;
	steps(600);
	cycle_phase_set(cy, CYCLE_OP);
	world.al_wkc = 0;
	steps(10);
	CHECK_EQ(stats.op_lost, 0);
	CHECK_EQ(stats.is_fail_safe, 0);
}

TEST(cycle_slaves, only_a_look_that_began_after_the_alert_makes_slaves_live_again)
{
	struct slave_set all = slave_set_all(2);
	uint64_t before;

	start_in_op();
	set_led(1);
	steps(3);
	before = cycle_alerts(cy);
	world.al_status = AL_OP | AL_SAFEOP;
	steps(1);
	world.al_status = AL_OP;
	cycle_slaves_set(cy, &all, before); /* by a look that was under way */
	steps(5);
	CHECK_EQ(world.seen_output & 1, 0);
	cycle_slaves_set(cy, &all, cycle_alerts(cy));
	steps(2);
	CHECK_EQ(world.seen_output & 1, 1);
	CHECK_EQ(stats.op_lost, 1);
}

TEST(cycle_slaves, an_observation_is_forgotten_when_the_phase_leaves_op)
{
	start_in_op();
	set_led(1);
	world.al_status = AL_OP | AL_SAFEOP;
	steps(2);
	cycle_phase_set(cy, CYCLE_SYNCED);
	steps(2);
	world.al_status = AL_OP;
	cycle_phase_set(cy, CYCLE_OP);
	steps(2);
	CHECK_EQ(world.seen_output & 1, 1);
}

TEST(cycle_slaves, a_stranger_in_init_is_an_alert_and_disturbs_nothing)
{
	uint64_t alerts;

	start_in_op();
	set_led(1);
	steps(3);
	alerts = cycle_alerts(cy);
	world.al_wkc = 3;
	world.al_status = AL_OP | AL_INIT;
	steps(10);
	CHECK_EQ(cycle_alerts(cy), alerts + 1);
	CHECK_EQ(stats.cycles_with_stranger, 10);
	CHECK_EQ(stats.op_lost, 0);
	CHECK_EQ(world.seen_output & 1, 1);
	check_event(next_event(EVENT_SLAVE_COUNT), EVENT_NO_SLAVE, (int64_t)stats.cycle_number - 9,
		    3, 2);
	/* One of ours in INIT would be missing in the process data. */
	world.status = EXCHANGE_WKC_LOW;
	steps(2);
	CHECK_EQ(stats.op_lost, 1);
	CHECK_EQ(world.seen_output & 1, 0);
}

TEST(cycle_slaves, a_slave_of_ours_that_falls_beside_a_stranger_ends_live_outputs)
{
	start_in_op();
	set_led(1);
	world.al_wkc = 3;
	world.al_status = AL_OP | AL_INIT;
	steps(10);
	CHECK_EQ(world.seen_output & 1, 1);
	world.al_status = AL_OP | AL_INIT | AL_SAFEOP | AL_ERROR;
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
}

TEST(cycle_slaves, the_state_of_a_device_that_joins_is_its_own)
{
	start_in_op();
	set_led(1);
	steps(3);
	world.al_wkc = 3;
	world.al_status = AL_OP | AL_SAFEOP | AL_ERROR;
	steps(20);
	CHECK_EQ(stats.op_lost, 0);
	CHECK_EQ(world.seen_output & 1, 1);
	/* It goes, and one of ours falls. */
	world.al_wkc = 2;
	steps(2);
	CHECK_EQ(stats.op_lost, 1);
	CHECK_EQ(world.seen_output & 1, 0);
}

TEST(cycle_slaves, the_state_of_a_stranger_is_accepted_once_ours_were_found_in_op)
{
	struct slave_set all = slave_set_all(2);

	start_in_op();
	set_led(1);
	steps(3);
	/* It came while a frame was lost: one of ours may have fallen then. */
	world.status = EXCHANGE_NO_FRAME;
	steps(1);
	world.status = EXCHANGE_OK;
	world.al_wkc = 3;
	world.al_status = AL_OP | AL_SAFEOP | AL_ERROR;
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
	cycle_slaves_set(cy, &all, cycle_alerts(cy));
	steps(20);
	CHECK_EQ(world.seen_output & 1, 1);
	CHECK_EQ(stats.op_lost, 1);
	world.al_status |= AL_PREOP; /* not seen by that look */
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
	/* Without the stranger nothing of it is accepted any more. */
	world.al_wkc = 2;
	world.al_status = AL_OP;
	steps(1);
	cycle_slaves_set(cy, &all, cycle_alerts(cy));
	steps(3);
	CHECK_EQ(world.seen_output & 1, 1);
	world.al_status = AL_OP | AL_SAFEOP;
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
}

TEST(cycle_slaves, a_missing_slave_that_a_split_image_names_takes_no_other_with_it)
{
	start_split_in_op();
	world.status = EXCHANGE_WKC_LOW;
	world.slaves_low = 2;
	world.al_wkc = 1;
	ring_seek(reader, ring_newest(reader));
	steps(10);
	for (unsigned i = 0; i < 10; i++) {
		struct got s = next_sample();

		CHECK_EQ(s.h.flags & (SAMPLE_NOT_OP | SAMPLE_FAIL_SAFE), 0);
		CHECK_EQ(s.h.slaves_bad.word[0], 2);
	}
	CHECK_EQ(stats.op_lost, 1);
	CHECK_EQ(stats.slave_bad[1], 0); /* it is known to be out of OP */
	CHECK_EQ(world.seen_output & 1, 1);
}

TEST(cycle_slaves, a_missing_slave_that_the_image_does_not_name_takes_all_with_it)
{
	start_split_in_op();
	/* Two missing, data of one: one without process data is gone, too, or somebody else. */
	world.status = EXCHANGE_WKC_LOW;
	world.slaves_low = 2;
	world.al_wkc = 0;
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
	start_split_in_op();
	world.status = EXCHANGE_WKC_LOW;
	world.slaves_low = 1; /* the reference clock */
	world.al_wkc = 1;
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
}
