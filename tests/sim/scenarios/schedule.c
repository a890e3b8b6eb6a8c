/* SPDX-License-Identifier: MIT */
/* What cannot fit into the period is refused before the cycle runs; what is computed is what the
 * segment then takes. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "harness/test.h"
#include "sim/harness/virtual_master.h"

static struct virtual_bench b;
static struct virtual_master vm;

/* A master for @slaves boards at @period; the result of its bring-up. */
static int open_at(unsigned slaves, const char *period)
{
	const char *const settings[] = { period, "dc.burst_frames=500", NULL };

	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = slaves, .seed = 3 });
	virtual_master_init(&vm, &b, settings);
	return virtual_master_bring_up(&vm);
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

TEST(sim_schedule, a_period_too_short_for_64_slaves_is_refused_and_the_one_named_works)
{
	const char *named;
	char period[64];
	int64_t began_ns;
	long us;

	CHECK(open_at(64, "cycle.period=250us") < 0);
	CHECK(strstr(vm.failure.text,
		     "cycle.period 250 us is too short: the frames of 64 slaves") != NULL);
	CHECK_EQ(vm.failure.code, EXIT_CODE_CONFIG);
	named = strstr(vm.failure.text, "set cycle.period to ");
	CHECK(named != NULL);
	us = strtol(named + strlen("set cycle.period to "), NULL, 10);
	CHECK(us > 250 && us < 1000);
	close_all();

	snprintf(period, sizeof(period), "cycle.period=%ldus", us - 10);
	CHECK(open_at(64, period) < 0);
	close_all();

	snprintf(period, sizeof(period), "cycle.period=%ldus", us);
	if (open_at(64, period) < 0) {
		test_fail(__FILE__, __LINE__, "%s: %s", period, vm.failure.text);
	}
	began_ns = virtual_bench_now_ns(&b);
	virtual_master_run(&vm, 2000);
	CHECK(virtual_bench_now_ns(&b) > began_ns);
	CHECK_EQ(atomic_load(&session_page(vm.session)->bus_state), BUS_OP);
	CHECK_EQ(vm.result.lost, 0);
	close_all();
}

/* The computed time less the host's share, against the shortest round trip of the segment. */
static void check_ratio(unsigned slaves, const char *period)
{
	const struct cycle_stats *st;
	double computed;
	double measured;

	CHECK_EQ(open_at(slaves, period), 0);
	virtual_master_run(&vm, 500);
	st = &session_page(vm.session)->cycle;
	computed = (double)atomic_load(&st->frames_need_ns);
	measured = (double)virtual_master_sample(&vm)->round_trip_ns;
	printf("%u slaves: computed %.1f us, measured %.1f us\n", slaves, computed / 1e3,
	       measured / 1e3);
	CHECK(computed >= measured);
	CHECK(computed <= measured * 1.15);
	close_all();
}

TEST(sim_schedule, the_computed_time_is_the_time_of_the_segment)
{
	check_ratio(1, "cycle.period=250us");
	check_ratio(2, "cycle.period=250us");
	check_ratio(16, "cycle.period=1ms");
	check_ratio(64, "cycle.period=1ms");
}
