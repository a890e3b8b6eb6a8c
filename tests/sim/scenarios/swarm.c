/* SPDX-License-Identifier: MIT */
/*
 * Many seeds, each a mixture of faults of its own: frames lost, late, doubled, damaged, cables,
 * power, AL errors, a master held up. In every cycle nothing may be invented; when the faults end,
 * all is well again.
 */
#include "base/prng.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

enum {
	SEEDS = 40,
	STORM_CYCLES = 3000,
	STEP_CYCLES = 5,
	PEACE_CYCLES = 3000, /* to be in OP again by then: the longest way measured takes 1070 */
	CHECK_CYCLES = 500,
};

enum trouble {
	TROUBLE_LOSE,
	TROUBLE_DROP,
	TROUBLE_DELAY,
	TROUBLE_DOUBLE,
	TROUBLE_TRUNCATE,
	TROUBLE_CORRUPT,
	TROUBLE_CABLE,
	TROUBLE_POWER,
	TROUBLE_AL_ERROR,
	TROUBLE_STALL,
	TROUBLES,
};

struct swarm {
	struct virtual_bench b;
	struct virtual_master vm;
	struct prng prng;
	uint32_t on;        /* bit per trouble: this seed has it */
	unsigned per_mille; /* of steps with trouble */
	int is_cut;
	int is_off;
};

static void toggle(struct swarm *sw, int *state, const char *breaks, const char *restores)
{
	virtual_bench_fault(&sw->b, *state ? restores : breaks);
	*state = !*state;
}

static void make_trouble(struct swarm *sw, enum trouble trouble)
{
	char line[80];

	switch (trouble) {
	case TROUBLE_LOSE:
		virtual_bench_fault(&sw->b, "at=0s lose");
		break;
	case TROUBLE_DROP:
		virtual_bench_fault(&sw->b, "at=0s drop");
		break;
	case TROUBLE_DELAY:
		snprintf(line, sizeof(line), "at=0s delay by=%uus",
			 (unsigned)prng_below(&sw->prng, 5000));
		virtual_bench_fault(&sw->b, line);
		break;
	case TROUBLE_DOUBLE:
		virtual_bench_fault(&sw->b, "at=0s double");
		break;
	case TROUBLE_TRUNCATE:
		virtual_bench_fault(&sw->b, "at=0s truncate");
		break;
	case TROUBLE_CORRUPT:
		virtual_bench_fault(&sw->b, "at=0s corrupt");
		break;
	case TROUBLE_CABLE:
		toggle(sw, &sw->is_cut, "at=0s cut slave=1", "at=0s heal slave=1");
		break;
	case TROUBLE_POWER:
		toggle(sw, &sw->is_off, "at=0s power-off slave=1", "at=0s power-on slave=1");
		break;
	case TROUBLE_AL_ERROR:
		virtual_bench_fault(&sw->b, "at=0s al-error slave=0 code=0x001a");
		break;
	case TROUBLE_STALL:
		in_process_stall(sw->b.host, (int64_t)prng_below(&sw->prng, 20 * NS_PER_MS));
		break;
	case TROUBLES:
		break;
	}
}

/* Numbers without a gap; outputs safe when the sample is flagged so, and live when it is not. */
static void check_nothing_invented(const struct swarm *sw, uint64_t seed)
{
	const struct virtual_result *res = &sw->vm.result;
	int is_safe = (virtual_master_sample(&sw->vm)->flags & SAMPLE_FAIL_SAFE) != 0;

	if (virtual_master_value(&sw->vm, "a.led") != (is_safe ? 0 : 1)) {
		test_fail(__FILE__, __LINE__, "seed %llu: the output is not %s",
			  (unsigned long long)seed, is_safe ? "safe" : "as it was set");
	}
	if (res->gaps != 0) {
		test_fail(__FILE__, __LINE__, "seed %llu: %llu gaps in the cycle numbers",
			  (unsigned long long)seed, (unsigned long long)res->gaps);
	}
}

static void storm(struct swarm *sw, uint64_t seed)
{
	for (unsigned i = 0; i < STORM_CYCLES / STEP_CYCLES; i++) {
		enum trouble trouble = (enum trouble)prng_below(&sw->prng, TROUBLES);

		if ((sw->on >> trouble & 1) && prng_below(&sw->prng, 1000) < sw->per_mille) {
			make_trouble(sw, trouble);
		}
		CHECK_EQ(virtual_master_run(&sw->vm, STEP_CYCLES), SESSION_GOES_ON);
		check_nothing_invented(sw, seed);
	}
	if (sw->is_cut) {
		make_trouble(sw, TROUBLE_CABLE);
	}
	if (sw->is_off) {
		make_trouble(sw, TROUBLE_POWER);
	}
}

static void set_led(struct virtual_master *vm)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_SET, .count = 1 };

	snprintf(rq.item[0].channel, sizeof(rq.item[0].channel), "a.led");
	rq.item[0].raw = 1;
	CHECK_EQ(virtual_master_ask(vm, &rq).result, 0);
}

/* A slave that had many AL errors would be tried again only after a pause. */
static void clear_alarms(struct virtual_master *vm)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_CLEAR };

	CHECK_EQ(virtual_master_ask(vm, &rq).result, 0);
}

static void one_seed(uint64_t seed)
{
	static const char *const names[] = { "slaves[0].name=a", "slaves[1].name=b", NULL };
	static struct swarm sw;
	uint64_t waited = 0;

	memset(&sw, 0, sizeof(sw));
	sw.prng.state = seed;
	sw.on = (uint32_t)prng_next(&sw.prng);
	sw.per_mille = 20 + (unsigned)prng_below(&sw.prng, 300);
	virtual_bench_init(&sw.b, &(struct virtual_spec){ .ppm = { 35, -70 }, .seed = seed });
	virtual_master_init(&sw.vm, &sw.b, names);
	if (virtual_master_bring_up(&sw.vm) < 0) {
		test_fail(__FILE__, __LINE__, "seed %llu: %s", (unsigned long long)seed,
			  sw.vm.failure.text);
	}
	set_led(&sw.vm);
	virtual_master_run(&sw.vm, 50);
	virtual_master_forget(&sw.vm);
	storm(&sw, seed);
	clear_alarms(&sw.vm);
	while (atomic_load(&session_page(sw.vm.session)->bus_state) != BUS_OP ||
	       atomic_load(&session_page(sw.vm.session)->cycle.dc_state) != DC_LOCKED) {
		if (waited >= PEACE_CYCLES) {
			virtual_master_print_events(&sw.vm, 30);
			test_fail(__FILE__, __LINE__,
				  "seed %llu: not in OP %llu cycles after it all",
				  (unsigned long long)seed, (unsigned long long)waited);
		}
		CHECK_EQ(virtual_master_run(&sw.vm, 10), SESSION_GOES_ON);
		waited += 10;
	}
	virtual_master_run(&sw.vm, 300);
	virtual_master_forget(&sw.vm);
	CHECK_EQ(virtual_master_run(&sw.vm, CHECK_CYCLES), SESSION_GOES_ON);
	if (sw.vm.result.bad != 0 || sw.vm.result.op != sw.vm.result.samples) {
		virtual_master_print_events(&sw.vm, 30);
		test_fail(__FILE__, __LINE__,
			  "seed %llu: in peace %llu samples, %llu in OP, %llu bad",
			  (unsigned long long)seed, (unsigned long long)sw.vm.result.samples,
			  (unsigned long long)sw.vm.result.op,
			  (unsigned long long)sw.vm.result.bad);
	}
	virtual_master_kill(&sw.vm);
	virtual_bench_done(&sw.b);
}

TEST(sim_swarm, after_random_faults_the_bus_reaches_op_again)
{
	const char *only = getenv("ECDAQ_SEED");

	if (only != NULL) {
		one_seed(strtoull(only, NULL, 10));
		return;
	}
	for (uint64_t seed = 1; seed <= SEEDS; seed++) {
		one_seed(seed);
	}
}
