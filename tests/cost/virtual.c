/* SPDX-License-Identifier: MIT */
/*
 * cost_virtual FOLDER SLAVES CYCLES [SEED]: so many cycles of 1 ms in OP of the whole master with
 * FB1111-Piccolos on virtual time, counted (cost.h): master, segment and the boards' firmware.
 * FOLDER is there for counting.py. Prints what the cycles were, the processor time that each took,
 * and a hash of all samples; 1 if a sample was not good.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/prng.h"
#include "cost/cost.h"
#include "sim/harness/virtual_master.h"

enum { SETTLE_CYCLES = 100, PPM_MAX = 80 };

static struct virtual_bench bench;
static struct virtual_master vm;

static void run(void *ctx)
{
	const unsigned *cycles = ctx;

	virtual_master_run(&vm, *cycles);
}

static void start(unsigned slaves, uint64_t seed)
{
	struct virtual_spec spec = { .slaves = slaves, .seed = seed };
	struct prng prng = { seed };

	for (unsigned i = 0; i < slaves; i++) {
		spec.ppm[i] = (double)prng_below(&prng, 2 * PPM_MAX) - PPM_MAX;
	}
	virtual_bench_init(&bench, &spec);
	virtual_master_init(&vm, &bench, NULL);
	if (virtual_master_bring_up(&vm) < 0) {
		fprintf(stderr, "cost_virtual: %s\n", vm.failure.text);
		exit(1);
	}
	virtual_master_run(&vm, SETTLE_CYCLES);
	virtual_master_forget(&vm);
	virtual_bench_measure(&bench);
}

int main(int argc, char **argv)
{
	unsigned slaves;
	unsigned cycles;
	int is_good;

	if (argc != 4 && argc != 5) {
		fprintf(stderr, "usage: cost_virtual FOLDER SLAVES CYCLES [SEED]\n");
		return 2;
	}
	slaves = cost_number(argv[2], LIMIT_SLAVES);
	cycles = cost_number(argv[3], 100000000);
	start(slaves, argc == 5 ? cost_number(argv[4], UINT32_MAX) : 1);
	cost_counted(run, &cycles);
	printf("%" PRIu64 " samples, %" PRIu64 " bad, %.0f ns a cycle, SYNC0 apart %" PRId64
	       " ns at most, hash %016" PRIx64 "\n",
	       vm.result.samples, vm.result.bad, (double)cost_cpu_ns() / cycles,
	       bench.scope.spread_max_ns, vm.result.hash);
	is_good = vm.result.samples >= cycles && vm.result.bad == 0 &&
		  vm.result.op == vm.result.samples && vm.result.gaps == 0;
	virtual_master_close(&vm);
	return is_good ? 0 : 1;
}
