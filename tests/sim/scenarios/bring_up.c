/* SPDX-License-Identifier: MIT */
/* From power-on to OP and back. */
#include <errno.h>

#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { STARTS = 60 };

static uint16_t al_status_code(const struct virtual_bench *b, unsigned slave)
{
	const uint8_t *reg = segment_esc(b->segment, slave)->reg + ESC_REG_AL_STATUS_CODE;

	return (uint16_t)(reg[0] | reg[1] << 8);
}

static void bring_up(struct virtual_master *vm)
{
	if (virtual_master_bring_up(vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm->failure.text);
	}
}

TEST(sim_bring_up, two_slaves_reach_op_and_every_sample_is_good)
{
	static struct virtual_bench b;
	static struct virtual_master vm;

	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 100, -100 }, .seed = 1 });
	virtual_master_init(&vm, &b, NULL);
	bring_up(&vm);
	CHECK(vm.op_ns < 5 * NS_PER_S);
	printf("OP after %.3f s of virtual time, lock after %.3f s\n", (double)vm.op_ns / 1e9,
	       (double)atomic_load(&session_page(vm.session)->cycle.dc_lock_ns) / 1e9);
	virtual_master_run(&vm, 20);
	virtual_master_forget(&vm);
	CHECK_EQ(virtual_master_run(&vm, 5000), SESSION_GOES_ON);
	CHECK(vm.result.samples >= 5000);
	CHECK_EQ(vm.result.op, vm.result.samples);
	CHECK_EQ(vm.result.bad, 0);
	CHECK_EQ(vm.result.gaps, 0);
	CHECK_EQ(vm.result.lost + vm.result.late + vm.result.skipped, 0);
	for (unsigned i = 0; i < 2; i++) {
		CHECK_EQ(virtual_bench_al_status(&b, i), AL_OP);
	}
	CHECK_EQ(virtual_master_stop(&vm), 0);
	for (unsigned i = 0; i < 2; i++) {
		CHECK_EQ(virtual_bench_al_status(&b, i), AL_INIT);
		CHECK_EQ(segment_esc(b.segment, i)->sync.is_running, 0);
	}
	virtual_master_close(&vm);
}

/* T23: OP is requested of no slave before the servo is locked. */
static void check_lock_before_op(struct virtual_master *vm)
{
	uint32_t dc_state = atomic_load(&session_page(vm->session)->cycle.dc_state);

	for (unsigned i = 0; i < 2; i++) {
		uint8_t asked = segment_esc(vm->bench->segment, i)->reg[ESC_REG_AL_CONTROL];

		CHECK((asked & AL_STATE_MASK) != AL_OP || dc_state == DC_LOCKED);
	}
}

TEST(sim_bring_up, op_is_requested_only_after_lock)
{
	static struct virtual_bench b;
	static struct virtual_master vm;

	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 30, 80 }, .seed = 2 });
	virtual_master_init(&vm, &b, NULL);
	vm.each_cycle = check_lock_before_op;
	bring_up(&vm);
	virtual_master_close(&vm);
}

/* T07: no watchdog trips on the way. */
static void check_no_watchdog(struct virtual_master *vm)
{
	for (unsigned i = 0; i < vm->bench->spec.slaves; i++) {
		CHECK(al_status_code(vm->bench, i) != AL_CODE_SM_WATCHDOG);
		CHECK((virtual_bench_al_status(vm->bench, i) & AL_ERROR) == 0);
	}
}

TEST(sim_bring_up, no_watchdog_trips_in_sixty_starts)
{
	for (uint64_t seed = 1; seed <= STARTS; seed++) {
		static struct virtual_bench b;
		static struct virtual_master vm;

		virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { -20, 60 }, .seed = seed });
		virtual_master_init(&vm, &b, NULL);
		vm.each_cycle = check_no_watchdog;
		bring_up(&vm);
		virtual_master_run(&vm, 50);
		virtual_master_close(&vm);
	}
}

TEST(sim_bring_up, a_master_killed_in_op_is_followed_by_one_that_reaches_op)
{
	static struct virtual_bench b;
	static struct virtual_master first;
	static struct virtual_master second;

	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 100, -100 }, .seed = 9 });
	virtual_master_init(&first, &b, NULL);
	bring_up(&first);
	virtual_master_run(&first, 500);
	virtual_master_kill(&first); /* SYNC0 continues, the slaves are in OP (T09) */
	CHECK_EQ(segment_esc(b.segment, 0)->sync.is_running, 1);
	virtual_master_init(&second, &b, NULL);
	bring_up(&second);
	virtual_master_run(&second, 20);
	virtual_master_forget(&second);
	CHECK_EQ(virtual_master_run(&second, 1000), SESSION_GOES_ON);
	CHECK_EQ(second.result.bad, 0);
	virtual_master_kill(&second);
	virtual_bench_done(&b);
}

TEST(sim_bring_up, a_bus_is_left_and_entered_again_and_again)
{
	static struct virtual_bench b;
	static struct virtual_master vm;

	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 10, -10 }, .seed = 4 });
	virtual_master_init(&vm, &b, NULL);
	for (int i = 0; i < 5; i++) {
		bring_up(&vm);
		CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
		CHECK_EQ(virtual_master_stop(&vm), 0);
	}
	virtual_master_close(&vm);
}

TEST(sim_bring_up, sixteen_slaves_reach_op)
{
	static struct virtual_bench b;
	static struct virtual_master vm;
	struct virtual_spec spec = { .slaves = 16, .seed = 5 };

	for (unsigned i = 0; i < 16; i++) {
		spec.ppm[i] = (double)i * 10 - 80;
	}
	virtual_bench_init(&b, &spec);
	virtual_master_init(&vm, &b, NULL);
	bring_up(&vm);
	virtual_master_run(&vm, 20);
	virtual_master_forget(&vm);
	virtual_master_run(&vm, 500);
	CHECK_EQ(vm.result.bad, 0);
	CHECK_EQ(atomic_load(&session_page(vm.session)->slave_count), 16);
	virtual_master_close(&vm);
}

static void check_refusal(const char *const *settings, enum exit_code code, const char *word)
{
	static struct virtual_bench b;
	static struct virtual_master vm;

	virtual_bench_init(&b, &(struct virtual_spec){ .seed = 6 });
	virtual_master_init(&vm, &b, settings);
	CHECK(virtual_master_bring_up(&vm) < 0);
	printf("%s\n", vm.failure.text);
	CHECK_EQ(vm.failure.code, code);
	CHECK(strstr(vm.failure.text, word) != NULL);
	CHECK(strchr(vm.failure.text, '\n') == NULL);
	virtual_master_close(&vm);
}

TEST(sim_bring_up, a_wrong_slave_one_too_few_and_one_too_many_are_refused)
{
	static const char *const wrong[] = { "slaves[0].vendor=0x2", "slaves[1].product=0x1234",
					     NULL };
	static const char *const few[] = { "slaves[0].vendor=0x2", "slaves[1].vendor=0x2",
					   "slaves[2].vendor=0x2", NULL };
	static const char *const many[] = { "slaves[0].vendor=0x2", "bus.presence=exact", NULL };

	check_refusal(wrong, EXIT_CODE_SLAVES, "0x00001234");
	check_refusal(few, EXIT_CODE_SLAVES, "3");
	check_refusal(many, EXIT_CODE_SLAVES, "2");
}

TEST(sim_bring_up, a_segment_without_power_has_no_slave)
{
	static struct virtual_bench b;
	static struct virtual_master vm;

	virtual_bench_init(&b, &(struct virtual_spec){ .seed = 6 });
	segment_power_off(b.segment, 0, virtual_bench_now_ns(&b));
	virtual_master_init(&vm, &b, NULL);
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK_EQ(vm.failure.code, EXIT_CODE_NO_SLAVE);
	CHECK(strstr(vm.failure.text, "no slave") != NULL);
	segment_power_on(b.segment, 0, virtual_bench_now_ns(&b));
	bring_up(&vm); /* the same session, as --wait does it */
	virtual_master_close(&vm);
}
