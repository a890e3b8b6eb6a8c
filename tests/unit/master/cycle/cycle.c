/* SPDX-License-Identifier: MIT */
/* The whole cycle: its reaction to what the bus returns. */
#include "cycle/cycle.h"

#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "harness/test.h"
#include "unit/master/cycle/bench.h"

TEST(cycle, every_sample_is_numbered_by_its_sync0_edge_and_good)
{
	uint64_t first = 0;

	start_in_op();
	steps(100);
	for (unsigned i = 0; i < 100; i++) {
		struct got s = next_sample();

		first = i == 0 ? s.h.cycle : first;
		CHECK_EQ(s.h.cycle, first + i);
		CHECK_EQ(s.h.dc_time_ns % PERIOD_NS, 0);
		CHECK_EQ((uint16_t)(s.h.dc_time_ns / PERIOD_NS), s.image[1] | s.image[2] << 8);
		CHECK_EQ(s.h.slaves_bad.word[0], 0);
		CHECK_EQ(s.h.flags & ~(uint32_t)SAMPLE_FAIL_SAFE, 0);
		CHECK(llabs(s.h.frame_dc_ns - s.h.dc_time_ns - PERIOD_NS / 2) < 25000);
	}
}

TEST(cycle, its_next_wake_is_the_deadline_that_it_sleeps_to)
{
	start_in_op();
	for (unsigned i = 0; i < 10; i++) {
		mono_t next = cycle_next_wake(cy);
		struct got s;

		CHECK(i == 0 || next.ns > world.now.ns);
		steps(1);
		s = next_sample();
		CHECK(i == 0 || s.h.wake_mono_ns - s.h.wake_latency_ns == next.ns);
	}
}

TEST(cycle, a_lost_frame_costs_one_bad_sample_a_slave_and_no_overrun)
{
	struct got s;

	start_in_op();
	world.status = EXCHANGE_NO_FRAME;
	steps(1);
	world.status = EXCHANGE_OK;
	steps(5);
	CHECK_EQ(stats.frames_lost, 1);
	CHECK_EQ(stats.samples_bad, 2);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
	CHECK_EQ(stats.overruns, 0);
	CHECK_EQ(stats.cycles_skipped, 0);
	s = next_sample();
	CHECK_EQ(s.h.flags & SAMPLE_LOST, SAMPLE_LOST);
	CHECK_EQ(s.h.slaves_bad.word[0], 3);
	CHECK_EQ(s.h.round_trip_ns, -1);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
	check_event(next_event(EVENT_FRAME_LOST), EVENT_NO_SLAVE, (int64_t)s.h.cycle, 1, 0);
	CHECK_EQ(count_events(EVENT_FRAME_LOST), 0);
}

TEST(cycle, a_long_loss_is_an_event_at_the_first_and_each_power_of_two)
{
	uint64_t first;

	start_in_op();
	world.status = EXCHANGE_NO_FRAME;
	steps(9);
	first = next_sample().h.cycle;
	for (int row = 1; row <= 8; row *= 2) {
		check_event(next_event(EVENT_FRAME_LOST), EVENT_NO_SLAVE, (int64_t)first + row - 1,
			    row, 0);
	}
	CHECK_EQ(count_events(EVENT_FRAME_LOST), 0);
}

TEST(cycle, a_sample_carries_the_phase_error_of_its_frame)
{
	struct got s;

	start_in_op();
	steps(1);
	CHECK(abs(next_sample().h.phase_error_ns) < 200);
	world.transit_ns += 7000;
	steps(1);
	s = next_sample();
	CHECK(abs(s.h.phase_error_ns - 7000) < 200);
	CHECK_EQ(s.h.phase_error_ns,
		 s.h.frame_dc_ns - s.h.dc_time_ns - PERIOD_NS / 2 - s.h.wake_latency_ns);
	CHECK(histogram_max_magnitude(&stats.phase) >= 6800);
}

TEST(cycle, a_counter_that_does_not_advance_makes_the_sample_of_that_slave_alone_bad)
{
	struct got s;

	start_in_op();
	world.conversions_from_dc = 0;
	world.counter[0]++;
	steps(1);
	s = next_sample();
	CHECK_EQ(s.h.slaves_bad.word[0], 2);
	CHECK_EQ(s.h.flags & SAMPLE_BAD_COUNTER, SAMPLE_BAD_COUNTER);
	CHECK_EQ(stats.samples_bad_unexplained, 1);
	CHECK_EQ(stats.slave_bad[1], 1);
	CHECK_EQ(stats.slave_bad[0], 0);
	check_event(next_event(EVENT_COUNTER_BAD), 1, (int64_t)s.h.cycle, world.counter[1],
		    world.counter[1] + 1);
	world.counter[0]++;
	world.counter[1]++;
	steps(1);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
}

TEST(cycle, the_first_sample_in_op_is_not_good_whatever_it_holds)
{
	struct got s;

	start_in_op();
	cycle_phase_set(cy, CYCLE_SYNCED);
	steps(3);
	cycle_phase_set(cy, CYCLE_OP);
	/* Slave b is stuck in the cycle in which OP is back: its inputs are those of another edge.
	 */
	world.conversions_from_dc = 0;
	ring_seek(reader, ring_newest(reader));
	steps(1);
	s = next_sample();
	CHECK_EQ(s.h.flags, SAMPLE_UNCHECKED | SAMPLE_FAIL_SAFE);
	CHECK_EQ(s.h.slaves_bad.word[0], 3);
	CHECK_EQ(stats.samples_bad, 2);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
	world.counter[0]++;
	steps(1);
	s = next_sample();
	CHECK_EQ(s.h.flags & SAMPLE_UNCHECKED, 0);
	CHECK_EQ(s.h.slaves_bad.word[0], 2);
	CHECK_EQ(stats.samples_bad_unexplained, 1);
}

TEST(cycle, a_late_or_doubled_frame_is_counted_and_flagged)
{
	struct got s;

	start_in_op();
	world.late = 1;
	world.doubled = 1;
	steps(1);
	s = next_sample();
	CHECK_EQ(s.h.flags & SAMPLE_LATE, SAMPLE_LATE);
	CHECK_EQ(s.h.flags & SAMPLE_DOUBLED, SAMPLE_DOUBLED);
	CHECK_EQ(stats.frames_late, 1);
	CHECK_EQ(stats.frames_doubled, 1);
	CHECK_EQ(s.h.slaves_bad.word[0], 0);
	check_event(next_event(EVENT_FRAME_LATE), EVENT_NO_SLAVE, (int64_t)s.h.cycle, 1, 0);
	check_event(next_event(EVENT_FRAME_DOUBLED), EVENT_NO_SLAVE, (int64_t)s.h.cycle, 0, 0);
}

TEST(cycle, a_frame_that_passes_while_the_slaves_convert_is_not_taken)
{
	struct got s;

	start_in_op();
	world.transit_ns = 540000;
	steps(1);
	world.transit_ns = 20000;
	CHECK_EQ(next_sample().h.flags & SAMPLE_SKIPPED, SAMPLE_SKIPPED);
	s = next_sample();
	CHECK_EQ(s.h.flags & SAMPLE_LATE, SAMPLE_LATE);
	CHECK_EQ(s.h.slaves_bad.word[0], 3);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
	steps(1);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
}

TEST(cycle, a_low_working_counter_is_bad_and_explained)
{
	start_in_op();
	world.status = EXCHANGE_WKC_LOW;
	steps(2);
	world.status = EXCHANGE_OK;
	steps(1);
	CHECK_EQ(stats.wkc_low, 2);
	CHECK_EQ(stats.samples_bad, 4);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
	CHECK_EQ(next_sample().h.flags & SAMPLE_WKC_LOW, SAMPLE_WKC_LOW);
}

TEST(cycle, an_output_goes_out_in_op_only_and_is_answered_with_its_cycle)
{
	uint64_t sequence;
	struct got s;

	start();
	steps(1000);
	board_begin(&board);
	board_put(&board, 0, 1);
	sequence = board_commit(&board);
	steps(5);
	CHECK_EQ(world.seen_output & 1, 0);
	cycle_phase_set(cy, CYCLE_OP);
	steps(2);
	CHECK_EQ(world.seen_output & 1, 1);
	CHECK_EQ(board.taken_sequence, sequence);
	board_begin(&board);
	board_put(&board, 0, 0);
	board_commit(&board);
	ring_seek(reader, ring_newest(reader));
	steps(3);
	do {
		s = next_sample();
	} while (s.image[0] & 1);
	CHECK_EQ(board.taken_cycle, s.h.cycle);
	set_led(1);
	steps(2);
	CHECK_EQ(world.seen_output & 1, 1);
	cycle_phase_set(cy, CYCLE_SAFE);
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
	CHECK_EQ(stats.is_fail_safe, 1);
}

TEST(cycle, a_missing_output_is_reported_in_one_line)
{
	char error[256] = "";
	struct cycle_spec spec = { .cfg = &cfg,
				   .plan = &plan,
				   .channels = channels,
				   .channel_count = 3,
				   .slaves = slaves,
				   .slave_count = 2 };

	start();
	cfg.output_count = 1;
	cfg.output[0] = (struct config_output){ .channel = "a.lamp", .line = 12 };
	snprintf(cfg.path, sizeof(cfg.path), "x.yaml");
	CHECK_EQ(cycle_create(&spec, &cy, error, sizeof(error)), -22);
	CHECK_STR(error, "x.yaml:12: outputs: a.lamp: no such output channel");
	cfg.output[0] = (struct config_output){ .channel = "a.led", .fail_safe = 3, .line = 13 };
	CHECK_EQ(cycle_create(&spec, &cy, error, sizeof(error)), -22);
	CHECK_STR(error, "x.yaml:13: outputs: a.led: the channel cannot hold its fail_safe value");
	cfg.output_count = 0;
	cfg.path[0] = '\0';
}

TEST(cycle, a_silent_owner_loses_its_output_after_its_timeout_in_cycles)
{
	unsigned cycles = 0;

	cfg.output_count = 1;
	cfg.output[0] = (struct config_output){
		.channel = "a.led", .min = 0, .max = 1, .timeout_ns = 20 * PERIOD_NS
	};
	start();
	cfg.output_count = 0;
	steps(300);
	cycle_phase_set(cy, CYCLE_OP);
	set_led(1);
	steps(3);
	CHECK_EQ(world.seen_output & 1, 1);
	while (world.seen_output & 1) {
		steps(1);
		CHECK(++cycles < 30);
	}
	CHECK(cycles >= 18 && cycles <= 22);
}

TEST(cycle, events_of_one_kind_are_limited_but_the_counters_are_not)
{
	unsigned count;

	start_in_op();
	world.late = 1;
	steps(500);
	count = count_events(EVENT_FRAME_LATE);
	CHECK_EQ(stats.frames_late, 500);
	CHECK(count >= 20 && count <= 40);
}

TEST(cycle, going_to_fail_safe_is_an_event_only_when_outputs_were_live)
{
	start_in_op();
	CHECK_EQ(count_events(EVENT_OUTPUT_FAIL_SAFE), 0);
	cycle_phase_set(cy, CYCLE_SAFE);
	steps(3);
	CHECK_EQ(count_events(EVENT_OUTPUT_FAIL_SAFE), 1);
}

/* The reference steps away: lock is lost some hundred cycles later. The outputs are as the policy
 * says, and live again when lock is back. Returns cycle_run()'s result, 1: it goes on. */
static int lose_lock(enum config_unlock policy, unsigned *ret_safe, unsigned *ret_live)
{
	unsigned n = 0;
	int r = 1;

	start_in_op();
	cfg.dc_unlock_policy = policy;
	set_led(1);
	steps(3);
	world.dc_offset_ns += PERIOD_NS / 3;
	*ret_safe = 0;
	*ret_live = 0;
	for (; n < 2000 && !cycle_has_stopped(cy, &r); n++) {
		steps(1);
		if (stats.dc_unlocks > 0) {
			*ret_live += world.seen_output & 1;
			*ret_safe += !(world.seen_output & 1);
		}
	}
	CHECK_EQ(stats.dc_unlocks, 1);
	return r;
}

TEST(cycle, loss_of_lock_in_op_is_reported_or_fail_safe_or_the_end)
{
	unsigned safe;
	unsigned live;

	CHECK_EQ(lose_lock(CONFIG_UNLOCK_REPORT, &safe, &live), 1);
	CHECK_EQ(safe, 0);
	CHECK(live > 1000);
	CHECK_EQ(lose_lock(CONFIG_UNLOCK_FAIL_SAFE, &safe, &live), 1);
	CHECK(safe > 100);
	CHECK(live > 100); /* again */
	CHECK_EQ(stats.dc_state, DC_LOCKED);
	CHECK_EQ(stats.is_fail_safe, 0);
	CHECK_EQ(lose_lock(CONFIG_UNLOCK_STOP, &safe, &live), -ENOLCK);
	CHECK_EQ(live, 1);
	CHECK_EQ(safe, 4);
	cfg.dc_unlock_policy = CONFIG_UNLOCK_REPORT;
}

TEST(cycle, a_clock_difference_that_no_set_of_good_ones_can_make_is_an_event)
{
	start_in_op();
	cfg.dc_diff_limit_ns = 1000;
	world.dc_diff_ns = 1023; /* 1000 and 23, ORed */
	steps(10);
	CHECK_EQ(stats.cycles_dc_diff_high, 0);
	CHECK_EQ(stats.dc_diff_max_ns, 1023);
	world.dc_diff_ns = 1024;
	steps(10);
	CHECK_EQ(stats.cycles_dc_diff_high, 10);
	check_event(next_event(EVENT_DC_DIFF_HIGH), EVENT_NO_SLAVE, (int64_t)stats.cycle_number - 9,
		    1024, 1000);
	CHECK_EQ(count_events(EVENT_DC_DIFF_HIGH), 0);
	world.dc_diff_ns = 5;
	steps(10);
	CHECK_EQ(stats.cycles_dc_diff_high, 10);
}

enum { DC_READS = 2000 };

struct dc_reads {
	_Atomic unsigned done;
	_Atomic int64_t least_ns; /* DC time minus host time */
	_Atomic int64_t most_ns;
};

static void *read_dc_time(void *arg)
{
	struct dc_reads *reads = arg;
	int64_t least_ns = INT64_MAX;
	int64_t most_ns = INT64_MIN;

	is_dc_reader = 1;
	for (unsigned n = 0; n < DC_READS; sched_yield()) {
		int64_t dc_ns;

		if (cycle_dc_now(cy, &dc_ns) == 0) {
			least_ns = dc_ns < least_ns ? dc_ns : least_ns;
			most_ns = dc_ns > most_ns ? dc_ns : most_ns;
			n++;
		}
	}
	atomic_store(&reads->least_ns, least_ns);
	atomic_store(&reads->most_ns, most_ns);
	atomic_store(&reads->done, 1);
	return NULL;
}

TEST(cycle_thread, the_dc_time_read_by_another_thread_belongs_to_its_host_time)
{
	struct dc_reads reads = { 0 };
	pthread_t thread;

	start_in_op();
	CHECK_EQ(pthread_create(&thread, NULL, read_dc_time, &reads), 0);
	while (!atomic_load(&reads.done)) {
		cycle_step(cy);
	}
	pthread_join(thread, NULL);
	/* One cycle is 1 ms: a time of one cycle with the host time of another is that far off. */
	CHECK(llabs(atomic_load(&reads.least_ns) - world.dc_offset_ns) < PERIOD_NS / 4);
	CHECK(llabs(atomic_load(&reads.most_ns) - world.dc_offset_ns) < PERIOD_NS / 4);
	stop();
}
