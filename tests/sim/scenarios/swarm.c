/* SPDX-License-Identifier: MIT */
/*
 * Many seeds, each a bus and a mixture of faults of its own: 2 to 4 slaves, either kind of
 * datagrams; frames lost, late, held, doubled, damaged, cables, power, resets, AL errors, missing
 * SYNC0 pulses, processors that hang, dead mailboxes, clocks that drift, a wall clock that steps, a
 * master held up for up to 0.9 s. In every cycle nothing may be invented: a good sample has the
 * value of its SYNC0 edge. When the faults end, all is well again.
 */
#include "base/prng.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "sim/harness/value_oracle.h"
#include "sim/harness/virtual_master.h"

enum {
	SEEDS = 40,
	STORM_CYCLES = 3000,
	STEP_CYCLES = 5,
	PEACE_CYCLES = 3000, /* to be in OP again by then: the longest way measured takes 1070 */
	CHECK_CYCLES = 500,
	CLEAR_CYCLES = 500,
	SLAVES_MIN = 2,
	SLAVES_MAX = 4,
	PPM_MAX = 80,
};

static const char *const names[SLAVES_MAX] = { "a", "b", "c", "d" };

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
	TROUBLE_HOLD,
	TROUBLE_RESET,
	TROUBLE_WATCHDOG,
	TROUBLE_SYNC0,
	TROUBLE_HANG,
	TROUBLE_MAILBOX,
	TROUBLE_DRIFT,
	TROUBLE_CLOCK_STEP,
	TROUBLE_LONG_STALL,
	TROUBLES,
};

struct swarm {
	struct virtual_bench b;
	struct virtual_master vm;
	struct prng prng;
	uint32_t on;        /* bit per trouble: this seed has it */
	unsigned per_mille; /* of steps with trouble */
	unsigned slaves;
	uint64_t seed;
	uint64_t compared; /* good samples with the value of their edge */
	int is_cut;
	int is_off;
	int is_corrupted; /* a byte of a frame of this step: a real cable's check sum would see it
			   */
};

static void toggle(struct swarm *sw, int *state, const char *breaks, const char *restores)
{
	virtual_bench_fault(&sw->b, *state ? restores : breaks);
	*state = !*state;
}

/* Of one slave: its processor, its chip, its clock. */
static void trouble_slave(struct swarm *sw, enum trouble trouble)
{
	unsigned slave = (unsigned)prng_below(&sw->prng, sw->slaves);
	char line[80];

	if (trouble == TROUBLE_HANG) {
		fb1111_piccolo_stall(segment_device(sw->b.segment, slave),
				     virtual_bench_now_ns(&sw->b),
				     (int64_t)prng_below(&sw->prng, 5 * NS_PER_MS));
		return;
	}
	if (trouble == TROUBLE_RESET) {
		snprintf(line, sizeof(line), "at=0s reset slave=%u", slave);
	} else if (trouble == TROUBLE_WATCHDOG) {
		snprintf(line, sizeof(line), "at=0s watchdog slave=%u", slave);
	} else if (trouble == TROUBLE_SYNC0) {
		snprintf(line, sizeof(line), "at=0s sync0-lost slave=%u count=%u", slave,
			 1 + (unsigned)prng_below(&sw->prng, 5));
	} else if (trouble == TROUBLE_MAILBOX) {
		snprintf(line, sizeof(line), "at=0s mailbox-stuck slave=%u for=%ums", slave,
			 1 + (unsigned)prng_below(&sw->prng, 300));
	} else {
		snprintf(line, sizeof(line), "at=0s drift slave=%u ppm=%d", slave,
			 (int)prng_below(&sw->prng, 2 * PPM_MAX) - PPM_MAX);
	}
	virtual_bench_fault(&sw->b, line);
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
		sw->is_corrupted = 1;
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
	case TROUBLE_LONG_STALL:
		in_process_stall(sw->b.host, (int64_t)prng_below(&sw->prng, 900 * NS_PER_MS));
		break;
	case TROUBLE_CLOCK_STEP:
		in_process_step_tai(sw->b.host, (int64_t)prng_below(&sw->prng, 7200 * NS_PER_S) -
							3600 * NS_PER_S);
		break;
	case TROUBLE_HOLD:
		virtual_bench_fault(&sw->b, "at=0s hold");
		break;
	case TROUBLE_RESET:
	case TROUBLE_WATCHDOG:
	case TROUBLE_SYNC0:
	case TROUBLE_HANG:
	case TROUBLE_MAILBOX:
	case TROUBLE_DRIFT:
		trouble_slave(sw, trouble);
		break;
	case TROUBLES:
		break;
	}
}

/* A good sample has the value that was there at its SYNC0 edge. */
static void check_values(struct virtual_master *vm)
{
	struct swarm *sw = vm->user;

	for (unsigned i = 0; i < sw->slaves && !sw->is_corrupted; i++) {
		uint64_t got;
		uint64_t was;
		int r = value_oracle_check(vm, i, names[i], &got, &was);

		if (r < 0) {
			virtual_master_print_events(vm, 30);
			test_fail(__FILE__, __LINE__,
				  "seed %llu, cycle %llu, slave %s: %llu is called good, it was "
				  "%llu",
				  (unsigned long long)sw->seed,
				  (unsigned long long)virtual_master_sample(vm)->cycle, names[i],
				  (unsigned long long)got, (unsigned long long)was);
		}
		sw->compared += (uint64_t)r;
	}
}

/* Numbers without a gap; outputs safe when the sample is flagged so. If it is not, they are live,
 * but for those of a slave that is out of OP by itself (per_slave): none of its samples is good. */
static void check_nothing_invented(const struct swarm *sw, uint64_t seed)
{
	const struct virtual_result *res = &sw->vm.result;
	const struct sample_header *h = virtual_master_sample(&sw->vm);
	int is_safe = (h->flags & SAMPLE_FAIL_SAFE) != 0;
	int may_be_out = sw->vm.cfg.bus_datagrams == CONFIG_DATAGRAMS_PER_SLAVE &&
			 slave_set_has(&h->slaves_bad, 0);
	uint64_t led = virtual_master_value(&sw->vm, "a.led");

	if (led != (is_safe ? 0 : 1) && (is_safe || !may_be_out)) {
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
		sw->is_corrupted = 0;
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

/* A slave that had many AL errors, or one in the middle of its way back, would be tried again only
 * after a pause, or not at all. */
static void clear_alarms(struct virtual_master *vm)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_CLEAR };

	CHECK_EQ(virtual_master_ask(vm, &rq).result, 0);
}

static void open_bus(struct swarm *sw)
{
	const char *const settings[] = { sw->seed % 3 == 0 ? "bus.datagrams=per_slave"
							   : "bus.datagrams=one",
					 "slaves[0].name=a",
					 "slaves[1].name=b",
					 sw->slaves > 2 ? "slaves[2].name=c" : NULL,
					 sw->slaves > 3 ? "slaves[3].name=d" : NULL,
					 NULL };
	struct virtual_spec spec = { .slaves = sw->slaves,
				     .make = value_oracle_slave,
				     .seed = sw->seed };

	for (unsigned i = 0; i < sw->slaves; i++) {
		spec.ppm[i] = (double)prng_below(&sw->prng, 2 * PPM_MAX) - PPM_MAX;
	}
	virtual_bench_init(&sw->b, &spec);
	virtual_master_init(&sw->vm, &sw->b, settings);
	sw->vm.user = sw;
	sw->vm.each_sample = check_values;
	if (virtual_master_bring_up(&sw->vm) < 0) {
		test_fail(__FILE__, __LINE__, "seed %llu: %s", (unsigned long long)sw->seed,
			  sw->vm.failure.text);
	}
}

static void wait_for_op(struct swarm *sw)
{
	const struct status_page *page = session_page(sw->vm.session);

	for (unsigned waited = 0; atomic_load(&page->bus_state) != BUS_OP ||
				  atomic_load(&page->cycle.dc_state) != DC_LOCKED;
	     waited += 10) {
		if (waited >= PEACE_CYCLES) {
			virtual_master_print_events(&sw->vm, 30);
			test_fail(__FILE__, __LINE__,
				  "seed %llu: not in OP %u cycles after it all: %s",
				  (unsigned long long)sw->seed, waited, page->message);
		}
		CHECK_EQ(virtual_master_run(&sw->vm, 10), SESSION_GOES_ON);
		if (waited % CLEAR_CYCLES == 0) {
			clear_alarms(&sw->vm);
		}
	}
}

static void check_peace(struct swarm *sw)
{
	const struct virtual_result *res = &sw->vm.result;

	virtual_master_run(&sw->vm, 300);
	virtual_master_forget(&sw->vm);
	CHECK_EQ(virtual_master_run(&sw->vm, CHECK_CYCLES), SESSION_GOES_ON);
	if (res->bad != 0 || res->op != res->samples) {
		virtual_master_print_events(&sw->vm, 30);
		test_fail(__FILE__, __LINE__,
			  "seed %llu: in peace %llu samples, %llu in OP, %llu bad",
			  (unsigned long long)sw->seed, (unsigned long long)res->samples,
			  (unsigned long long)res->op, (unsigned long long)res->bad);
	}
}

/* Returns how many good samples had the value of their edge. */
static uint64_t one_seed(uint64_t seed)
{
	static struct swarm sw;

	memset(&sw, 0, sizeof(sw));
	sw.seed = seed;
	sw.prng.state = seed;
	sw.on = (uint32_t)prng_next(&sw.prng);
	sw.per_mille = 20 + (unsigned)prng_below(&sw.prng, 300);
	sw.slaves = SLAVES_MIN + (unsigned)prng_below(&sw.prng, SLAVES_MAX - SLAVES_MIN + 1);
	open_bus(&sw);
	set_led(&sw.vm);
	virtual_master_run(&sw.vm, 50);
	virtual_master_forget(&sw.vm);
	storm(&sw, seed);
	wait_for_op(&sw);
	check_peace(&sw);
	virtual_master_close(&sw.vm);
	CHECK(sw.compared > (uint64_t)CHECK_CYCLES * sw.slaves);
	return sw.compared;
}

TEST(sim_swarm, after_random_faults_the_bus_reaches_op_again)
{
	const char *only = getenv("ECDAQ_SEED");
	uint64_t compared = 0;

	if (only != NULL) {
		one_seed(strtoull(only, NULL, 10));
		return;
	}
	for (uint64_t seed = 1; seed <= SEEDS; seed++) {
		compared += one_seed(seed);
	}
	printf("%d seeds: %llu good samples have the value of their SYNC0 edge\n", SEEDS,
	       (unsigned long long)compared);
}
