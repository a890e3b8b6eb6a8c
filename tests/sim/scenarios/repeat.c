/* SPDX-License-Identifier: MIT */
/* The same seed is the same run, to the last byte of the last sample. */
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

static struct virtual_result run(uint64_t seed, const char *fault)
{
	static struct virtual_bench b;
	static struct virtual_master vm;

	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 100, -100 },
						       .host_ppm = 12.5,
						       .seed = seed,
						       .wake_spike_ns = 200 * NS_PER_US,
						       .spikes_per_million = 5000 });
	virtual_master_init(&vm, &b, NULL);
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
	if (fault != NULL) {
		virtual_bench_fault(&b, fault);
	}
	CHECK_EQ(virtual_master_run(&vm, 5000), SESSION_GOES_ON);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	virtual_master_close(&vm);
	return vm.result;
}

TEST(sim_repeat, the_same_seed_gives_the_same_bytes)
{
	struct virtual_result first = run(42, "p=0.01 lose");
	struct virtual_result second = run(42, "p=0.01 lose");

	CHECK(first.samples > 5000);
	CHECK(first.lost > 10);
	CHECK_EQ(first.hash, second.hash);
	CHECK_MEM(&first, &second, sizeof(first));
}

TEST(sim_repeat, another_seed_or_another_fault_gives_other_bytes)
{
	uint64_t plain = run(42, NULL).hash;

	CHECK(plain != run(43, NULL).hash);
	CHECK(plain != run(42, "at=1s lose").hash);
}
