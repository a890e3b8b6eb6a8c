/* SPDX-License-Identifier: MIT */
/*
 * Master and simulated segment as ordinary processes of a busy machine: wakes are late by up to
 * 40 ms, and frames reach the reference late where the segment's process is. The master knows of
 * the first; the second looks like a phase error that always has the same sign.
 */
#include <math.h>

#include "base/prng.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

enum { SEEDS = 50, SETTLE_CYCLES = 1000, MEASURE_CYCLES = 2000 };

#define PPM_SPAN 100.0
#define LOCK_LIMIT_NS (2 * NS_PER_S) /* measured: 1.02 s */
#define RATE_LIMIT_PPM 10.0          /* measured: 4.8 ppm: skipped periods are not corrected */

/* One wake in @one_in is late by @least_ns and up to @spread_ns more. */
struct lateness {
	uint64_t one_in;
	int64_t least_ns;
	int64_t spread_ns;
};

static const struct lateness wakes[] = {
	{ 1, 0, 100 * NS_PER_US },
	{ 50, NS_PER_MS, 2 * NS_PER_MS },
	{ 2000, 10 * NS_PER_MS, 30 * NS_PER_MS },
};

struct figures {
	int64_t lock_ns;
	double rate_ppm; /* of the master's frequency, mean: off the reference's */
};

static void delay_next_wake(struct virtual_master *vm)
{
	struct prng *prng = vm->user;

	for (size_t i = 0; i < sizeof(wakes) / sizeof(wakes[0]); i++) {
		const struct lateness *w = &wakes[i];

		if (prng_below(prng, w->one_in) == 0) {
			in_process_stall(vm->bench->host,
					 w->least_ns +
						 (int64_t)prng_below(prng, (uint64_t)w->spread_ns));
		}
	}
}

static double mean_correction_ppm(struct virtual_master *vm)
{
	double sum = 0;

	for (unsigned i = 0; i < MEASURE_CYCLES; i++) {
		CHECK_EQ(virtual_master_run(vm, 1), SESSION_GOES_ON);
		sum += (double)atomic_load(&session_page(vm->session)->cycle.correction_ppb) * 1e-3;
	}
	return sum / MEASURE_CYCLES;
}

static struct figures one_start(uint64_t seed, const char *const *faults)
{
	static struct virtual_bench b;
	static struct virtual_master vm;
	struct prng prng = { seed };
	double reference_ppm = (prng_unit(&prng) - 0.5) * PPM_SPAN;
	double host_ppm = (prng_unit(&prng) - 0.5) * PPM_SPAN;
	struct figures f;

	virtual_bench_init(&b, &(struct virtual_spec){
				       .ppm = { reference_ppm, -reference_ppm },
				       .host_ppm = host_ppm,
				       .seed = seed,
			       });
	virtual_master_init(&vm, &b, NULL);
	for (; *faults != NULL; faults++) {
		virtual_bench_fault(&b, *faults);
	}
	vm.user = &prng;
	vm.each_cycle = delay_next_wake;
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "seed %llu: %s", (unsigned long long)seed,
			  vm.failure.text);
	}
	f.lock_ns = atomic_load(&session_page(vm.session)->cycle.dc_lock_ns);
	virtual_master_run(&vm, SETTLE_CYCLES);
	virtual_master_forget(&vm);
	f.rate_ppm = fabs(mean_correction_ppm(&vm) + reference_ppm + host_ppm);
	CHECK_EQ(vm.result.unlocked, 0);
	CHECK_EQ(vm.result.bad_unexplained, 0);
	CHECK(vm.result.skipped > 0);
	virtual_master_close(&vm);
	return f;
}

static void lock_from_all_seeds(const char *what, const char *const *faults)
{
	struct figures worst = { 0 };

	for (uint64_t seed = 1; seed <= SEEDS; seed++) {
		struct figures f = one_start(seed, faults);

		if (f.lock_ns <= 0 || f.lock_ns > LOCK_LIMIT_NS || f.rate_ppm > RATE_LIMIT_PPM) {
			test_fail(__FILE__, __LINE__,
				  "seed %llu: lock %lld ns, frequency %.1f ppm off",
				  (unsigned long long)seed, (long long)f.lock_ns, f.rate_ppm);
		}
		worst.lock_ns = f.lock_ns > worst.lock_ns ? f.lock_ns : worst.lock_ns;
		worst.rate_ppm = fmax(worst.rate_ppm, f.rate_ppm);
	}
	printf("worst of %d starts, %s: lock %lld ms, frequency %.1f ppm off\n", SEEDS, what,
	       (long long)(worst.lock_ns / NS_PER_MS), worst.rate_ppm);
}

TEST(sim_busy_machine, late_wakes_alone_delay_no_lock)
{
	lock_from_all_seeds("late wakes", (const char *const[]){ NULL });
}

TEST(sim_busy_machine, frames_that_reach_the_reference_late_delay_lock_by_a_second_at_most)
{
	lock_from_all_seeds(
		"and frames late, one in five by up to 300 us",
		(const char *const[]){ "p=1 jitter by=50us", "p=0.2 jitter by=300us", NULL });
}
