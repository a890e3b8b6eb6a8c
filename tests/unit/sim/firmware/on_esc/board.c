/* SPDX-License-Identifier: MIT */
/* The firmware on the real ESC model, through the modelled pins, seen from the wire. */
#include "bench.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { MS = 1000000, US = 1000 };

static void check_samples(unsigned slave, unsigned cycles)
{
	struct bench b;
	struct signal_spec signal = signal_default();
	uint16_t last;

	bench_begin(&b);
	bench_periodic_op(&b, slave);
	last = bench_inputs(&b, slave).counter;
	for (unsigned i = 0; i < cycles; i++) {
		struct bench_input in;

		bench_run_to(&b, b.edge_ns[slave] + 3 * BENCH_CYCLE_NS / 2);
		in = bench_inputs(&b, slave);
		CHECK_EQ(in.counter, (uint16_t)(last + 1));
		CHECK_EQ(in.sample_time_ns, b.edge_system_ns[slave]);
		CHECK_EQ(in.adc, signal_adc(&signal, b.edge_ns[slave]));
		CHECK_EQ(in.status, 0);
		bench_outputs(&b, slave, (uint8_t)(i & 1), 0);
		last = in.counter;
	}
	CHECK_EQ(bench_get(&b, slave, ESC_REG_AL_STATUS, 2), AL_OP);
	bench_end(&b);
}

TEST(piccolo, each_cycle_brings_one_sample_with_the_exact_time_and_value_of_its_edge)
{
	check_samples(0, 70000); /* the counter wraps on the way */
	check_samples(1, 3000);
}

TEST(piccolo, inputs_are_in_sm3_23_us_after_sync0_and_not_before)
{
	struct bench b;
	uint16_t before;
	int64_t edge_ns;

	bench_begin(&b);
	bench_periodic_op(&b, 0);
	before = bench_inputs(&b, 0).counter;
	bench_run(&b, MS / 2 - 10 * US);
	while (b.edges[0] == 0 || b.now_ns - b.edge_ns[0] > 5 * US) {
		bench_run(&b, US); /* the clock is off by ppm: find the edge */
	}
	edge_ns = b.edge_ns[0];
	bench_run_to(&b, edge_ns + 18 * US); /* and 4 us until the datagram has come by */
	CHECK_EQ(bench_inputs(&b, 0).counter, before);
	bench_run_to(&b, edge_ns + 24 * US);
	CHECK_EQ(bench_inputs(&b, 0).counter, (uint16_t)(before + 1));
	/* 0.5 us and 28 octets of 799.7 ns */
	CHECK_EQ(fb1111_piccolo_copy_ns(segment_device(b.segment, 0)), 22891);
	bench_end(&b);
}

TEST(piccolo, the_led_follows_within_a_refresh)
{
	struct bench b;
	struct sim_device *board;

	bench_begin(&b);
	board = segment_device(b.segment, 0);
	bench_periodic_op(&b, 0);
	CHECK_EQ(fb1111_piccolo_led(board), 0);
	bench_outputs(&b, 0, 1, 0);
	bench_run(&b, 12 * MS);
	CHECK_EQ(fb1111_piccolo_led(board), 1);
	bench_outputs(&b, 0, 0, 0);
	bench_run(&b, 12 * MS);
	CHECK_EQ(fb1111_piccolo_led(board), 0);
	bench_end(&b);
}

TEST(piccolo, a_dead_master_is_noticed_by_the_watchdog)
{
	struct bench b;
	struct sim_device *board;

	bench_begin(&b);
	board = segment_device(b.segment, 0);
	bench_periodic_op(&b, 0);
	bench_outputs(&b, 0, 1, 0);
	bench_run(&b, 95 * MS);
	CHECK_EQ(bench_get(&b, 0, ESC_REG_AL_STATUS, 2), AL_OP);
	CHECK_EQ(fb1111_piccolo_led(board), 1);
	bench_run(&b, 20 * MS);
	CHECK_EQ(bench_get(&b, 0, ESC_REG_AL_STATUS, 2), AL_SAFEOP | AL_ERROR);
	CHECK_EQ(bench_code(&b, 0), AL_CODE_SM_WATCHDOG);
	CHECK_EQ(fb1111_piccolo_led(board), 0);
	bench_outputs(&b, 0, 1, 0);
	CHECK_EQ(bench_request(&b, 0, AL_SAFEOP | AL_ERROR), AL_SAFEOP);
	CHECK_EQ(bench_request(&b, 0, AL_OP), AL_OP);
	bench_end(&b);
}

TEST(piccolo, sync0_switched_off_in_op_is_named)
{
	struct bench b;

	bench_begin(&b);
	bench_periodic_op(&b, 0);
	bench_put(&b, 0, ESC_REG_DC_ACTIVATION, 0, 1);
	for (unsigned i = 0; i < 40; i++) {
		bench_outputs(&b, 0, 0, 0);
		bench_run(&b, MS);
	}
	CHECK_EQ(bench_get(&b, 0, ESC_REG_AL_STATUS, 2), AL_SAFEOP | AL_ERROR);
	CHECK_EQ(bench_code(&b, 0), AL_CODE_FATAL_SYNC_ERROR);
	bench_end(&b);
}

TEST(piccolo, no_sync0_on_the_way_to_op_is_named)
{
	struct bench b;
	uint64_t start;

	bench_begin(&b);
	bench_preop(&b, 0);
	/* T10: the start time has passed, so the unit is active and will never fire */
	start = bench_get(&b, 0, ESC_REG_DC_SYSTEM_TIME, 8) - MS;
	bench_put(&b, 0, ESC_REG_DC_START_TIME, start, 8);
	bench_put(&b, 0, ESC_REG_DC_SYNC0_CYCLE, BENCH_CYCLE_NS, 4);
	bench_put(&b, 0, ESC_REG_DC_ACTIVATION, 3, 1);
	CHECK_EQ(bench_request(&b, 0, AL_SAFEOP), AL_SAFEOP);
	bench_outputs(&b, 0, 0, 0);
	CHECK_EQ(bench_request(&b, 0, AL_OP), AL_SAFEOP);
	bench_run(&b, 1000 * MS);
	CHECK_EQ(bench_get(&b, 0, ESC_REG_AL_STATUS, 2), AL_SAFEOP | AL_ERROR);
	CHECK_EQ(bench_code(&b, 0), AL_CODE_NO_SYNC_ERROR);
	bench_end(&b);
}

/* SDOs without a pause; returns the longest time from an edge to its sample in SM3. */
static int64_t storm(uint32_t cycle_ns)
{
	struct bench b;
	uint16_t first;
	unsigned edges;

	bench_begin(&b);
	b.cycle_ns = cycle_ns;
	bench_periodic_op(&b, 0);
	first = bench_inputs(&b, 0).counter;
	edges = b.edges[0];
	for (unsigned i = 0; i < 1000; i++) {
		uint32_t value = 0;

		bench_run(&b, (int64_t)(i % 13) * 7 * US); /* at any phase to the edges */
		CHECK_EQ(bench_sdo_read(&b, 0, 0x6000, 1, &value), 0);
		CHECK_EQ(bench_sdo_read(&b, 0, 0x1001, 0, &value), 0x06020000);
		bench_outputs(&b, 0, 0, 0);
		CHECK_EQ(bench_inputs(&b, 0).status, 0);
	}
	bench_run_to(&b, b.edge_ns[0] + (int64_t)cycle_ns * 3 / 2);
	CHECK_EQ((uint16_t)(bench_inputs(&b, 0).counter - first), (uint16_t)(b.edges[0] - edges));
	CHECK_EQ(bench_get(&b, 0, ESC_REG_AL_STATUS, 2), AL_OP);
	bench_end(&b);
	return b.copy_ns_max[0];
}

TEST(piccolo, an_sdo_storm_in_op_costs_no_sample_and_next_to_no_time)
{
	/* one access of the main loop, 20 octets, is the most that an edge waits for */
	CHECK(storm(BENCH_CYCLE_NS) < 22891 + 17000);
}

TEST(piccolo, at_the_shortest_cycle_an_sdo_storm_costs_no_sample)
{
	int64_t worst_ns = storm(100 * US);

	CHECK(worst_ns > 23000); /* edges and mailbox do meet */
	CHECK(worst_ns < 22891 + 17000);
}

TEST(piccolo, a_hung_cpu_shows_as_an_overrun)
{
	struct bench b;
	struct bench_input before, after;

	bench_begin(&b);
	bench_periodic_op(&b, 0);
	before = bench_inputs(&b, 0);
	fb1111_piccolo_stall(segment_device(b.segment, 0), b.now_ns, 7 * MS / 2);
	bench_run(&b, 3 * MS + MS / 4);
	CHECK_EQ(bench_inputs(&b, 0).counter, before.counter);
	bench_run(&b, MS / 2);
	after = bench_inputs(&b, 0);
	CHECK_EQ(after.counter, (uint16_t)(before.counter + 1));
	CHECK_EQ(after.status, 4);
	CHECK_EQ(after.sample_time_ns, b.edge_system_ns[0]);
	bench_run(&b, MS);
	CHECK_EQ(bench_inputs(&b, 0).status, 0);
	CHECK_EQ(bench_inputs(&b, 0).counter, (uint16_t)(before.counter + 2));
	bench_end(&b);
}

TEST(piccolo, a_power_cycled_board_starts_in_init_and_can_be_led_to_op_again)
{
	struct bench b;

	bench_begin(&b);
	bench_periodic_op(&b, 1);
	bench_outputs(&b, 1, 1, 0);
	bench_run(&b, 12 * MS);
	segment_power_off(b.segment, 1, b.now_ns);
	bench_run(&b, 50 * MS);
	segment_power_on(b.segment, 1, b.now_ns);
	bench_run(&b, 5 * MS);
	CHECK_EQ(bench_get(&b, 1, ESC_REG_AL_STATUS, 2), AL_INIT);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 1)), 0);
	b.mailbox_counter[1] = 0;
	bench_periodic_op(&b, 1);
	CHECK_EQ(bench_inputs(&b, 1).sample_time_ns, b.edge_system_ns[1]);
	bench_end(&b);
}

/* --- one-shot --- */

static uint64_t dc_now(struct bench *b, unsigned slave)
{
	return bench_get(b, slave, ESC_REG_DC_SYSTEM_TIME, 8);
}

/* Run @span_ns with the outputs written every ms, as a master does. */
static void run_with_outputs(struct bench *b, unsigned slave, uint64_t oneshot_ns, int64_t span_ns)
{
	for (int64_t t = 0; t < span_ns; t += MS) {
		bench_outputs(b, slave, 0, oneshot_ns);
		bench_run(b, MS);
	}
}

TEST(piccolo, a_oneshot_fires_once_at_its_dc_time_in_both_boards)
{
	struct bench b;
	struct signal_spec signal = signal_default();

	bench_begin(&b);
	for (unsigned slave = 0; slave < BENCH_SLAVES; slave++) {
		uint64_t at;

		bench_oneshot_op(&b, slave);
		at = dc_now(&b, slave) + 40 * MS + 123;
		CHECK_EQ(bench_inputs(&b, slave).status, 1);
		run_with_outputs(&b, slave, at, 20 * MS);
		CHECK_EQ(bench_inputs(&b, slave).status, 3);
		CHECK_EQ(b.edges[slave], 0);
		run_with_outputs(&b, slave, at, 100 * MS);
		CHECK_EQ(b.edges[slave], 1);
		CHECK_EQ(b.edge_system_ns[slave], at);
		CHECK_EQ(bench_inputs(&b, slave).status, 1);
		CHECK_EQ(bench_inputs(&b, slave).counter, 1);
		CHECK_EQ(bench_inputs(&b, slave).sample_time_ns, at);
		CHECK_EQ(bench_inputs(&b, slave).adc, signal_adc(&signal, b.edge_ns[slave]));

		at = dc_now(&b, slave) + 30 * MS;
		run_with_outputs(&b, slave, at, 60 * MS);
		CHECK_EQ(b.edges[slave], 2);
		CHECK_EQ(bench_inputs(&b, slave).sample_time_ns, at);
		CHECK_EQ(bench_inputs(&b, slave).counter, 2);
	}
	bench_end(&b);
}

TEST(piccolo, a_oneshot_in_the_past_is_refused_and_zero_withdraws)
{
	struct bench b;

	bench_begin(&b);
	bench_oneshot_op(&b, 0);
	run_with_outputs(&b, 0, dc_now(&b, 0) - MS, 30 * MS);
	CHECK_EQ(bench_inputs(&b, 0).status, 1);
	CHECK_EQ(bench_get(&b, 0, ESC_REG_DC_ACTIVATION, 1), 0);
	run_with_outputs(&b, 0, dc_now(&b, 0) + 60 * MS, 30 * MS);
	CHECK_EQ(bench_inputs(&b, 0).status, 3);
	run_with_outputs(&b, 0, 0, 100 * MS);
	CHECK_EQ(bench_inputs(&b, 0).status, 1);
	CHECK_EQ(b.edges[0], 0);
	CHECK_EQ(bench_inputs(&b, 0).counter, 0);
	bench_end(&b);
}

TEST(piccolo, a_thousand_oneshots_in_a_row_all_fire_to_the_nanosecond)
{
	struct bench b;

	bench_begin(&b);
	bench_oneshot_op(&b, 0);
	for (unsigned i = 1; i <= 1000; i++) {
		uint64_t at = dc_now(&b, 0) + 15 * MS + i * 997;

		run_with_outputs(&b, 0, at, 30 * MS);
		CHECK_EQ(b.edges[0], i);
		CHECK_EQ(b.edge_system_ns[0], at);
		CHECK_EQ(bench_inputs(&b, 0).counter, (uint16_t)i);
		CHECK_EQ(bench_inputs(&b, 0).sample_time_ns, at);
	}
	bench_end(&b);
}
