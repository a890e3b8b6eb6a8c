/* SPDX-License-Identifier: MIT */
/* bus.datagrams per_slave: a slave that is lost takes no other with it. */
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

enum { SLAVES = 3, LAST = SLAVES - 1 };

enum { BACK_MS = 1400 }; /* to OP: three times what was measured */

static struct virtual_bench b;
static struct virtual_master vm;
static uint64_t bad_at_start[SLAVES]; /* the first sample in OP is not good by definition */

static struct cycle_stats *stats(void)
{
	return (struct cycle_stats *)&session_page(vm.session)->cycle;
}

/* Bad samples of slave @i since open_all(). */
static uint64_t bad_of(unsigned i)
{
	return atomic_load(&stats()->slave_bad[i]) - bad_at_start[i];
}

static void open_with(struct virtual_spec spec, const char *datagrams)
{
	const char *const settings[] = { datagrams, "slaves[0].name=a", "slaves[1].name=b",
					 "slaves[2].name=c", NULL };

	virtual_bench_init(&b, &spec);
	virtual_master_init(&vm, &b, settings);
	virtual_master_settle(&vm);
	for (unsigned i = 0; i < SLAVES; i++) {
		bad_at_start[i] = atomic_load(&stats()->slave_bad[i]);
		CHECK_EQ(bad_at_start[i], 1);
	}
}

static void open_all(const char *datagrams)
{
	open_with((struct virtual_spec){ .slaves = SLAVES, .ppm = { 30, -40, 15 }, .seed = 41 },
		  datagrams);
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

static uint32_t state(void)
{
	return atomic_load(&session_page(vm.session)->bus_state);
}

static int set_led(const char *channel, uint64_t raw)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_SET, .count = 1 };

	snprintf(rq.item[0].channel, sizeof(rq.item[0].channel), "%s", channel);
	rq.item[0].raw = raw;
	return virtual_master_ask(&vm, &rq).result;
}

static void wait_for_op(void)
{
	for (unsigned ms = 0; state() != BUS_OP; ms += 10) {
		if (ms > BACK_MS) {
			virtual_master_print_events(&vm, 20);
			test_fail(__FILE__, __LINE__, "not in OP again");
		}
		CHECK_EQ(virtual_master_run(&vm, 10), SESSION_GOES_ON);
	}
}

/* Break the last slave, check the others, restore it, check all. */
static void check_others_continue(const char *breaks, const char *restores)
{
	uint64_t bad[SLAVES];
	uint64_t good[SLAVES];

	open_all("bus.datagrams=per_slave");
	CHECK_EQ(set_led("a.led", 1), 0);
	CHECK_EQ(set_led("c.led", 1), 0);
	virtual_bench_fault(&b, breaks);
	virtual_master_run(&vm, 500);
	CHECK_EQ(state(), BUS_RECOVERING);
	for (unsigned i = 0; i < SLAVES; i++) {
		bad[i] = bad_of(i);
		good[i] = atomic_load(&stats()->slave_good[i]);
	}
	CHECK_EQ(bad[0], 0);
	CHECK_EQ(bad[1], 0);
	CHECK(bad[LAST] < 150); /* until it is known to be lost */
	/* The frame itself names who is missing: no cycle without outputs for the others. */
	CHECK_EQ(vm.result.op, vm.result.samples);
	CHECK_EQ(atomic_load(&stats()->op_lost), 1);
	CHECK_EQ(virtual_master_run(&vm, 1000), SESSION_GOES_ON);
	CHECK_EQ(virtual_master_sample(&vm)->slaves_bad.word[0], 1u << LAST);
	CHECK_EQ(virtual_master_value(&vm, "a.led"), 1);
	CHECK_EQ(virtual_master_value(&vm, "c.led"), 0); /* at fail-safe until it is in OP */
	CHECK_EQ(set_led("b.led", 1), 0);
	CHECK_EQ(virtual_master_value(&vm, "b.led"), 1);
	CHECK(atomic_load(&stats()->slave_good[0]) >= good[0] + 1000);
	CHECK_EQ(atomic_load(&stats()->slave_good[LAST]), good[LAST]);
	virtual_bench_fault(&b, restores);
	wait_for_op();
	CHECK_EQ(bad_of(0), 0);
	CHECK_EQ(bad_of(1), 0);
	CHECK_EQ(atomic_load(&stats()->is_fail_safe), 0);
	virtual_master_run(&vm, 100);
	CHECK_EQ(bad_of(LAST), bad[LAST] + 1); /* its first, again */
	virtual_master_forget(&vm);
	CHECK_EQ(virtual_master_run(&vm, 1000), SESSION_GOES_ON);
	CHECK_EQ(vm.result.bad, 0);
	CHECK_EQ(vm.result.gaps, 0);
	CHECK_EQ(virtual_master_value(&vm, "c.led"), 1);
	close_all();
}

TEST(sim_partial, others_continue_while_a_slave_has_no_power)
{
	check_others_continue("at=10ms power-off slave=2", "at=0s power-on slave=2");
}

TEST(sim_partial, others_continue_while_a_cable_is_out)
{
	check_others_continue("at=10ms cut slave=2", "at=0s heal slave=2");
}

TEST(sim_partial, a_slave_that_falls_to_safe_op_is_restored_alone)
{
	open_all("bus.datagrams=per_slave");
	virtual_bench_fault(&b, "at=10ms al-error slave=1 code=0x001a");
	virtual_master_run(&vm, 200);
	wait_for_op();
	virtual_master_run(&vm, 100);
	CHECK_EQ(bad_of(0), 1); /* the first after those */
	CHECK_EQ(bad_of(LAST), 1);
	/* The frame does not say which slave it is: all outputs are safe until the service thread
	 * has looked, within its next pass. */
	CHECK(vm.result.op < vm.result.samples);
	CHECK(vm.result.samples - vm.result.op <= 12);
	CHECK_EQ(atomic_load(&stats()->op_lost), 1);
	CHECK(atomic_load(&session_page(vm.session)->cycle.slave_good[0]) > 280);
	close_all();
}

TEST(sim_partial, without_the_reference_clock_all_outputs_are_safe)
{
	open_all("bus.datagrams=per_slave");
	virtual_bench_fault(&b, "at=10ms al-error slave=0 code=0x001a");
	virtual_master_run(&vm, 120);
	wait_for_op();
	CHECK(vm.result.op < vm.result.samples);
	close_all();
}

TEST(sim_partial, with_one_datagram_a_lost_slave_makes_all_outputs_safe)
{
	open_all("bus.datagrams=one");
	CHECK_EQ(set_led("a.led", 1), 0);
	virtual_bench_fault(&b, "at=10ms power-off slave=2");
	virtual_master_run(&vm, 500);
	CHECK_EQ(state(), BUS_RECOVERING);
	CHECK_EQ(virtual_master_sample(&vm)->slaves_bad.word[0], 7);
	CHECK_EQ(virtual_master_value(&vm, "a.led"), 0);
	CHECK_EQ(atomic_load(&stats()->is_fail_safe), 1);
	CHECK(set_led("b.led", 1) < 0);
	close_all();
}

/* Reference and host at the same rate, or with jitter between them: the reference's answer equals
 * the prediction again and again. */
static void check_coincidences(double reference_ppm, const char *jitter)
{
	uint64_t bad;
	uint64_t unexplained;

	open_with((struct virtual_spec){ .slaves = SLAVES,
					 .ppm = { reference_ppm, -40, 15 },
					 .seed = 5 },
		  "bus.datagrams=per_slave");
	if (jitter != NULL) {
		virtual_bench_fault(&b, jitter);
	}
	virtual_bench_fault(&b, "at=10ms power-off slave=2");
	virtual_master_run(&vm, 1000);
	bad = atomic_load(&stats()->slave_bad[0]);
	unexplained = atomic_load(&stats()->samples_bad_unexplained);
	virtual_master_run(&vm, 5000);
	CHECK_EQ(atomic_load(&stats()->slave_bad[0]), bad);
	CHECK_EQ(atomic_load(&stats()->samples_bad_unexplained), unexplained);
	close_all();
}

TEST(sim_partial, an_answer_of_the_reference_as_predicted_is_not_its_loss)
{
	check_coincidences(0, NULL);
	check_coincidences(0.5, NULL);
	check_coincidences(30, "p=1 jitter by=300ns");
}
