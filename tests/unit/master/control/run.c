/* SPDX-License-Identifier: MIT */
/* The program in its cycles: what it sees, what becomes of what it sets, and of its time. */
#include <errno.h>
#include <math.h>
#include <signal.h>

#include "bench.h"

static struct ecdaq_input adc;
static struct ecdaq_input signed_in;
static struct ecdaq_input led_in;
static struct ecdaq_output led;
static struct ecdaq_output out12;
static struct ecdaq_output f32;

static int find_all(const struct ecdaq_init *in, void **ret_state)
{
	static int state = 4711;

	*ret_state = &state;
	CHECK_EQ(in->period_ns, 1000000);
	CHECK_EQ(in->budget_ns, 200000);
	CHECK_EQ(in->slave_count, 2);
	CHECK_EQ(ecdaq_find_input(in, "a.adc", &adc), 0);
	CHECK_EQ(ecdaq_find_input(in, "b.signed", &signed_in), 0);
	CHECK_EQ(ecdaq_find_input(in, "a.led", &led_in), 0);
	CHECK_EQ(ecdaq_find_output(in, "a.led", &led), 0);
	CHECK_EQ(ecdaq_find_output(in, "b.out12", &out12), 0);
	CHECK_EQ(ecdaq_find_output(in, "b.f32", &f32), 0);
	return 0;
}

static void begin(int (*cycle)(const struct ecdaq_cycle *cy, void *state))
{
	struct probe *probe = bench_configure();

	probe->init = find_all;
	probe->cycle = cycle;
	CHECK_EQ(bench_begin(), 0);
}

static void check_output(unsigned place, int is_set, uint64_t raw)
{
	uint64_t got = 0;

	CHECK_EQ(bench_output(place, &got), is_set);
	if (is_set) {
		CHECK_EQ(got, raw);
	}
}

static int look(const struct ecdaq_cycle *cy, void *state)
{
	CHECK_EQ(*(int *)state, 4711);
	CHECK_EQ(cy->number, 101);
	CHECK_EQ(cy->dc_time_ns, 101000000);
	CHECK_EQ(cy->period_ns, 1000000);
	CHECK_EQ(cy->flags, ECDAQ_WKC_LOW | ECDAQ_FIRST);
	CHECK(ecdaq_get(cy, adc) == 0x123 * 0.5 + 1);
	CHECK_EQ(ecdaq_get_raw(cy, adc), 0x123);
	CHECK_EQ(ecdaq_get_int(cy, signed_in), -2);
	CHECK_EQ(ecdaq_get_raw(cy, signed_in), 0xfffe);
	CHECK(ecdaq_get(cy, signed_in) == -2.0);
	CHECK_EQ(ecdaq_get_raw(cy, led_in), 1);
	CHECK(ecdaq_is_good(cy, adc));
	CHECK(!ecdaq_is_good(cy, signed_in));
	CHECK(ecdaq_is_slave_good(cy, 0));
	CHECK(!ecdaq_is_slave_good(cy, 1));
	CHECK(!ecdaq_is_slave_good(cy, 64));
	return ECDAQ_GO_ON;
}

TEST(control, a_cycle_sees_inputs_flags_and_which_slaves_are_good)
{
	begin(look);
	bench.image[0] = 1;
	bench.image[8] = 0x23;
	bench.image[9] = 0x01;
	bench.image[10] = 0xfe;
	bench.image[11] = 0xff;
	bench.sample.flags = SAMPLE_WKC_LOW;
	slave_set_add(&bench.sample.slaves_bad, 1);
	CHECK_EQ(bench_run(), CONTROL_DONE);
	CHECK_EQ(bench.status.calls, 1);
	CHECK_EQ(bench.status.state, CONTROL_RUNNING);
	bench_done();
}

static double wanted;
static int set_result;

static int set_out12(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	set_result = ecdaq_set(cy, out12, wanted);
	return ECDAQ_GO_ON;
}

static void check_set(double physical, int result, int is_set, int64_t raw)
{
	wanted = physical;
	CHECK_EQ(bench_run(), CONTROL_DONE);
	CHECK_EQ(set_result, result);
	check_output(BOARD_OUT12, is_set, (uint64_t)raw & 0xfff);
}

TEST(control, a_value_that_is_set_is_rounded_limited_or_refused)
{
	begin(set_out12);
	check_set(12.34, 0, 1, 123);
	check_set(-12.36, 0, 1, -124);
	check_set(-51, 1, 1, -510); /* below min: the cycle limits it */
	check_set(1000, 1, 1, 2047);
	check_set(-1000, 1, 1, -2048);
	check_set(INFINITY, 1, 1, 2047);
	check_set(-INFINITY, 1, 1, -2048);
	check_set(1, 0, 1, 10);
	check_set(NAN, -EINVAL, 0, 0); /* fail-safe rather than the last good value */
	CHECK_EQ(bench.status.limited, 5);
	CHECK_EQ(bench.status.refused, 1);
	bench_done();
}

static int set_float(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	set_result = ecdaq_set(cy, f32, wanted);
	return ECDAQ_GO_ON;
}

TEST(control, a_float_output_takes_no_infinity)
{
	begin(set_float);
	wanted = 0.5;
	bench_run();
	check_output(BOARD_FLOAT, 1, 0x3f000000);
	wanted = INFINITY;
	bench_run();
	CHECK_EQ(set_result, -EINVAL);
	check_output(BOARD_FLOAT, 0, 0);
	bench_done();
}

static int set_led_to_wanted(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	set_result = ecdaq_set(cy, led, wanted);
	return ECDAQ_GO_ON;
}

TEST(control, a_bool_output_takes_0_and_1_only)
{
	static const double wrong[] = { 0.4, 0.6, 2, -1, INFINITY };

	begin(set_led_to_wanted);
	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		wanted = 1;
		bench_run();
		CHECK_EQ(set_result, 0);
		check_output(BOARD_LED, 1, 1);
		wanted = wrong[i];
		bench_run();
		CHECK_EQ(set_result, -EINVAL);
		check_output(BOARD_LED, 0, 0);
	}
	CHECK_EQ(bench.status.limited, 0);
	bench_done();
}

static int set_raw_and_release(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	switch (cy->number) {
	case 101:
		CHECK_EQ(ecdaq_set_raw(cy, led, 1), 0);
		CHECK_EQ(ecdaq_set_raw(cy, out12, 0xfff), 0);
		break;
	case 102:
		break; /* what was set stays */
	case 103:
		ecdaq_release(cy, led);
		CHECK_EQ(ecdaq_set_raw(cy, out12, 0x1000), -EINVAL);
		break;
	default:
		CHECK_EQ(ecdaq_set_raw(cy, out12, 1001), 1); /* above max */
		break;
	}
	return ECDAQ_GO_ON;
}

TEST(control, an_output_stays_until_it_is_set_again_or_released)
{
	begin(set_raw_and_release);
	for (int i = 0; i < 2; i++) {
		bench_run();
		check_output(BOARD_LED, 1, 1);
		check_output(BOARD_OUT12, 1, 0xfff);
		check_output(BOARD_FLOAT, 0, 0);
	}
	bench_run();
	check_output(BOARD_LED, 0, 0);
	check_output(BOARD_OUT12, 0, 0);
	bench_run();
	check_output(BOARD_OUT12, 1, 1001);
	bench_done();
}

static int use_wild_handles(const struct ecdaq_cycle *cy, void *state)
{
	static const uint32_t wild[] = { 0, 2, 5, 6, 2047, 2048, UINT32_MAX };

	(void)state;
	for (size_t i = 0; i < sizeof(wild) / sizeof(wild[0]); i++) {
		struct ecdaq_output out = { wild[i] }; /* inputs, somebody else's, nothing */

		CHECK_EQ(ecdaq_set(cy, out, 1), -EINVAL);
		CHECK_EQ(ecdaq_set_raw(cy, out, 1), -EINVAL);
		ecdaq_release(cy, out);
	}
	for (size_t i = 3; i < sizeof(wild) / sizeof(wild[0]); i++) {
		struct ecdaq_input in = { wild[i] };

		CHECK_EQ(ecdaq_get_raw(cy, in), 0);
		CHECK_EQ(ecdaq_get_int(cy, in), 0);
		CHECK(ecdaq_get(cy, in) == 0.0);
		CHECK(!ecdaq_is_good(cy, in));
	}
	return ECDAQ_GO_ON;
}

TEST(control, invalid_handles_do_no_harm)
{
	begin(use_wild_handles);
	CHECK_EQ(bench_run(), CONTROL_DONE);
	for (unsigned i = 0; i <= BOARD_FOREIGN; i++) {
		check_output(i, 0, 0);
	}
	bench_done();
}

static uint32_t elapsed;
static uint32_t flags;
static int verdict;

static int set_led(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	elapsed = cy->elapsed;
	flags = cy->flags;
	ecdaq_set(cy, led, 1);
	return verdict;
}

TEST(control, after_a_pause_the_next_call_is_a_first_one)
{
	begin(set_led);
	verdict = ECDAQ_GO_ON;
	control_pause(bench.control); /* before the first call: nothing to pause */
	bench_run();
	CHECK_EQ(flags, ECDAQ_FIRST);
	CHECK_EQ(elapsed, 0);
	bench.sample.cycle += 3;
	bench_run();
	CHECK_EQ(flags, 0);
	CHECK_EQ(elapsed, 4);
	check_output(BOARD_LED, 1, 1);
	control_pause(bench.control);
	check_output(BOARD_LED, 0, 0);
	CHECK_EQ(bench.status.state, CONTROL_WAITING);
	bench_run();
	CHECK_EQ(flags, ECDAQ_FIRST);
	CHECK_EQ(elapsed, 0);
	bench_done();
}

TEST(control, a_program_can_request_fail_safe_and_continue_later)
{
	begin(set_led);
	verdict = ECDAQ_MAKE_SAFE;
	CHECK_EQ(bench_run(), CONTROL_DONE);
	check_output(BOARD_LED, 0, 0);
	CHECK(control_is_safe(bench.control));
	CHECK_EQ(bench.status.state, CONTROL_SAFE);
	CHECK_EQ(bench.status.safe_cycles, 1);
	verdict = ECDAQ_GO_ON;
	CHECK_EQ(bench_run(), CONTROL_DONE);
	check_output(BOARD_LED, 1, 1);
	CHECK(!control_is_safe(bench.control));
	bench_done();
}

static int64_t takes_ns;

static int take_time(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	ecdaq_set(cy, led, 1);
	bench.call_ns = takes_ns;
	return ECDAQ_GO_ON;
}

TEST(control, a_call_within_its_budget_is_measured_and_no_overrun)
{
	begin(take_time);
	takes_ns = 200000;
	CHECK_EQ(bench_run(), CONTROL_DONE);
	CHECK_EQ(control_time_ns(bench.control), 200000);
	CHECK_EQ(bench.status.overruns, 0);
	CHECK_EQ(bench.status.time.count, 1);
	CHECK_EQ(bench.status.time.max_ns, 200000);
	bench_done();
}

TEST(control, an_overrun_is_counted)
{
	begin(take_time);
	takes_ns = 200001;
	for (int i = 0; i < 3; i++) {
		CHECK_EQ(bench_run(), CONTROL_OVERRAN);
		check_output(BOARD_LED, 1, 1);
	}
	CHECK_EQ(bench.status.overruns, 3);
	CHECK_EQ(bench.status.state, CONTROL_RUNNING);
	bench_done();
}

TEST(control, an_overrun_can_park_it_until_the_bus_reaches_op_again)
{
	begin(take_time);
	bench.cfg.control_overrun = CONFIG_OVERRUN_FAIL_SAFE;
	takes_ns = 200001;
	CHECK_EQ(bench_run(), CONTROL_PARK);
	check_output(BOARD_LED, 0, 0);
	CHECK(control_is_safe(bench.control));
	CHECK_EQ(bench.status.state, CONTROL_PARKED);
	CHECK_EQ(bench_run(), CONTROL_REST);
	CHECK_EQ(bench.status.calls, 1);
	control_pause(bench.control);
	takes_ns = 1;
	CHECK_EQ(bench_run(), CONTROL_DONE);
	check_output(BOARD_LED, 1, 1);
	CHECK_EQ(bench.status.state, CONTROL_RUNNING);
	bench_done();
}

TEST(control, an_overrun_can_stop_it_for_good)
{
	char text[320];

	begin(take_time);
	bench.cfg.control_overrun = CONFIG_OVERRUN_STOP;
	takes_ns = 350000;
	CHECK_EQ(bench_run(), CONTROL_STOP);
	check_output(BOARD_LED, 0, 0);
	control_pause(bench.control);
	CHECK_EQ(bench_run(), CONTROL_REST);
	CHECK_EQ(bench.status.state, CONTROL_STOPPED);
	control_describe_end(bench.control, text, sizeof(text));
	CHECK_STR(text, "control: " PROBE_PATH
			": took 350 us of 200 us (control.budget) in cycle 101, and "
			"control.overrun is stop");
	bench_done();
}

static int64_t busy_ns;

static int ask_busy(const struct ecdaq_cycle *cy, void *state)
{
	(void)cy;
	(void)state;
	busy_ns = control_busy_ns(bench.control, (mono_t){ bench.now_ns + 77 });
	return ECDAQ_GO_ON;
}

TEST(control, the_duration_of_a_running_call_can_be_read_from_another_thread)
{
	begin(ask_busy);
	CHECK_EQ(control_busy_ns(bench.control, (mono_t){ 5000 }), 0);
	bench_run();
	CHECK_EQ(busy_ns, 77);
	CHECK_EQ(control_busy_ns(bench.control, (mono_t){ 5000 }), 0);
	bench_done();
}

/* The stack of the fault handler is memory of the control program: it goes with it. */
TEST(control, leaving_gives_the_thread_its_signal_stack_and_mask_back)
{
	stack_t before;
	stack_t inside;
	stack_t after;
	sigset_t mask;

	bench_configure();
	CHECK_EQ(bench_begin(), 0);
	sigemptyset(&mask);
	sigaddset(&mask, SIGFPE);
	CHECK_EQ(pthread_sigmask(SIG_BLOCK, &mask, NULL), 0);
	CHECK_EQ(sigaltstack(NULL, &before), 0);
	control_enter(bench.control);
	CHECK_EQ(sigaltstack(NULL, &inside), 0);
	CHECK(inside.ss_sp != before.ss_sp && (inside.ss_flags & SS_DISABLE) == 0);
	CHECK_EQ(pthread_sigmask(SIG_BLOCK, NULL, &mask), 0);
	CHECK_EQ(sigismember(&mask, SIGFPE), 0);
	control_leave(bench.control);
	CHECK_EQ(sigaltstack(NULL, &after), 0);
	CHECK(after.ss_sp == before.ss_sp && after.ss_flags == before.ss_flags);
	CHECK_EQ(pthread_sigmask(SIG_BLOCK, NULL, &mask), 0);
	CHECK_EQ(sigismember(&mask, SIGFPE), 1);
	sigemptyset(&mask);
	sigaddset(&mask, SIGFPE);
	CHECK_EQ(pthread_sigmask(SIG_UNBLOCK, &mask, NULL), 0);
	bench_done();
}
