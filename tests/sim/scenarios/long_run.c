/* SPDX-License-Identifier: MIT */
/*
 * sim_long_run [CYCLES [SEED]]: two slaves at +-100 ppm on virtual time, every sample checked.
 * Without CYCLES 5,400,000 of them: an hour and a half at 1 ms. Prints figures and ends with 0 if
 * all holds.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "sim/harness/virtual_master.h"

enum { DEFAULT_CYCLES = 5400000, SETTLE_CYCLES = 20, SPREAD_LIMIT_NS = 100 };

static double seconds(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	return (double)ts.tv_sec + (double)ts.tv_nsec * 1e-9;
}

static int report(const struct virtual_master *vm, double took_s, uint64_t cycles)
{
	const struct virtual_result *res = &vm->result;
	const struct virtual_scope *scope = &vm->bench->scope;
	const struct cycle_stats *st = &session_page(vm->session)->cycle;
	double speed = (double)cycles * (double)vm->cfg.cycle_period_ns * 1e-9 / took_s;

	printf("cycles              %" PRIu64 " in %.1f s, %.1f times real time\n", cycles, took_s,
	       speed);
	printf("samples             %" PRIu64 ", gaps in the numbers %" PRIu64 "\n", res->samples,
	       res->gaps);
	printf("bad                 %" PRIu64 ", lost %" PRIu64 ", late %" PRIu64
	       ", skipped %" PRIu64 "\n",
	       res->bad, res->lost, res->late, res->skipped);
	printf("phase error         p50 %" PRId64 " ns, p99.9 %" PRId64 " ns, max %" PRId64 " ns\n",
	       histogram_percentile(&st->phase, 500000), histogram_percentile(&st->phase, 999000),
	       res->phase_max_ns);
	printf("SYNC0 apart         max %" PRId64 " ns of %" PRIu64 " pairs\n",
	       scope->spread_max_ns, scope->compared);
	printf("hash                %016" PRIx64 "\n", res->hash);
	return res->bad == 0 && res->gaps == 0 && res->op == res->samples &&
			       scope->spread_max_ns <= SPREAD_LIMIT_NS &&
			       scope->compared >= cycles - SETTLE_CYCLES
		       ? EXIT_SUCCESS
		       : EXIT_FAILURE;
}

int main(int argc, char **argv)
{
	static struct virtual_bench bench;
	static struct virtual_master vm;
	uint64_t cycles = argc > 1 ? strtoull(argv[1], NULL, 10) : DEFAULT_CYCLES;
	uint64_t seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
	double start_s;
	int result;

	if (cycles == 0 || argc > 3) {
		fprintf(stderr, "usage: sim_long_run [CYCLES [SEED]]\n");
		return 2;
	}
	virtual_bench_init(&bench, &(struct virtual_spec){ .ppm = { 100, -100 }, .seed = seed });
	virtual_master_init(&vm, &bench, NULL);
	if (virtual_master_bring_up(&vm) < 0) {
		fprintf(stderr, "sim_long_run: %s\n", vm.failure.text);
		return EXIT_FAILURE;
	}
	printf("OP after            %.3f s, lock after %.3f s\n", (double)vm.op_ns * 1e-9,
	       (double)atomic_load(&session_page(vm.session)->cycle.dc_lock_ns) * 1e-9);
	virtual_master_run(&vm, SETTLE_CYCLES);
	virtual_master_forget(&vm);
	virtual_bench_measure(&bench);
	start_s = seconds();
	virtual_master_run(&vm, cycles);
	result = report(&vm, seconds() - start_s, cycles);
	virtual_master_close(&vm);
	return result;
}
