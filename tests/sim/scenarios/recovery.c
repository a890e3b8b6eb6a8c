/* SPDX-License-Identifier: MIT */
/* Cables and power: what is lost comes back, and samples are marked bad in between. */
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

/* At most so many ms back to OP: two to three times what was measured. */
enum { STATE_MS = 200 };

static struct virtual_bench b;
static struct virtual_master vm;

static void open_all(const char *const *settings)
{
	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 30, -40 }, .seed = 31 });
	virtual_master_init(&vm, &b, settings);
	virtual_master_settle(&vm);
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

static uint32_t state(void)
{
	return atomic_load(&session_page(vm.session)->bus_state);
}

/* Until the bus is in OP, in steps of 10 ms; how many ms that took. */
static uint64_t wait_for_op(uint64_t limit_ms)
{
	uint64_t ms = 0;

	while (state() != BUS_OP) {
		if (ms >= limit_ms) {
			test_fail(__FILE__, __LINE__, "not in OP after %llu ms: %s",
				  (unsigned long long)ms, session_page(vm.session)->message);
		}
		CHECK_EQ(virtual_master_run(&vm, 10), SESSION_GOES_ON);
		ms += 10;
	}
	return ms;
}

static void check_all_good_again(void)
{
	virtual_master_run(&vm, 100);
	virtual_master_forget(&vm);
	CHECK_EQ(virtual_master_run(&vm, 1000), SESSION_GOES_ON);
	CHECK_EQ(vm.result.op, vm.result.samples);
	CHECK_EQ(vm.result.bad, 0);
	CHECK_EQ(vm.result.gaps, 0);
}

static void check_falls_and_returns(const char *breaks, const char *restores, uint64_t limit_ms)
{
	uint64_t ms;

	open_all(NULL);
	virtual_bench_fault(&b, breaks);
	virtual_master_run(&vm, 500);
	CHECK_EQ(state(), BUS_RECOVERING);
	CHECK_EQ(vm.result.gaps, 0);
	CHECK_EQ(vm.result.bad_unexplained, 0);
	virtual_bench_fault(&b, restores);
	ms = wait_for_op(limit_ms);
	printf("%s, %s: OP again after %llu ms\n", breaks, restores, (unsigned long long)ms);
	check_all_good_again();
	close_all();
}

TEST(sim_recovery, a_cable_pulled_between_slaves_and_put_back)
{
	check_falls_and_returns("at=10ms cut slave=1", "at=0s heal slave=1", 200);
}

TEST(sim_recovery, a_cable_pulled_at_the_master_and_put_back)
{
	check_falls_and_returns("at=10ms cut slave=0", "at=0s heal slave=0", 200);
}

TEST(sim_recovery, a_slave_without_power_and_with_power_again)
{
	check_falls_and_returns("at=10ms power-off slave=1", "at=0s power-on slave=1", 1200);
}

TEST(sim_recovery, a_slave_that_reports_an_error_is_restored)
{
	open_all(NULL);
	virtual_bench_fault(&b, "at=10ms al-error slave=1 code=0x001a");
	virtual_master_run(&vm, 200);
	wait_for_op(STATE_MS);
	check_all_good_again();
	close_all();
}

TEST(sim_recovery, a_master_delayed_past_the_watchdog_restores_the_slaves)
{
	open_all(NULL);
	in_process_stall(b.host, 300 * NS_PER_MS);
	virtual_master_run(&vm, 300);
	wait_for_op(STATE_MS);
	CHECK_EQ(vm.result.bad_unexplained, 0);
	check_all_good_again();
	close_all();
}

TEST(sim_recovery, the_whole_segment_restarts_after_a_power_cut)
{
	int r = SESSION_GOES_ON;

	open_all(NULL);
	virtual_bench_fault(&b, "at=10ms power-off slave=0");
	for (int i = 0; i < 1000 && r == SESSION_GOES_ON; i++) {
		r = virtual_master_run(&vm, 10);
	}
	CHECK_EQ(r, SESSION_LOST);
	session_drop(vm.session);
	segment_power_on(b.segment, 0, virtual_bench_now_ns(&b));
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
	check_all_good_again();
	close_all();
}

TEST(sim_recovery, port_errors_are_shown_at_their_slave)
{
	open_all(NULL);
	virtual_bench_fault(&b, "at=10ms port-error slave=1 port=0");
	virtual_master_run(&vm, 1000);
	CHECK(atomic_load(&session_page(vm.session)->slave[1].rx_errors[0]) > 0);
	CHECK_EQ(atomic_load(&session_page(vm.session)->slave[0].rx_errors[0]), 0);
	CHECK_EQ(state(), BUS_OP);
	close_all();
}
