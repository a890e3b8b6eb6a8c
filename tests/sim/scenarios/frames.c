/* SPDX-License-Identifier: MIT */
/* What becomes of a frame: lost, late, doubled, damaged. And of a cycle that comes late. */
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

struct run {
	struct virtual_bench b;
	struct virtual_master vm;
	struct cycle_stats *stats;
};

static void run_open(struct run *r)
{
	virtual_bench_init(&r->b, &(struct virtual_spec){ .ppm = { 40, -60 }, .seed = 11 });
	virtual_master_init(&r->vm, &r->b, NULL);
	if (virtual_master_bring_up(&r->vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", r->vm.failure.text);
	}
	virtual_master_run(&r->vm, 100);
	virtual_master_forget(&r->vm);
	r->stats = (struct cycle_stats *)&session_page(r->vm.session)->cycle;
}

static void run_close(struct run *r)
{
	virtual_master_close(&r->vm);
}

/* T01 */
TEST(sim_frames, one_lost_frame_costs_one_cycle_and_no_overrun)
{
	static struct run r;

	run_open(&r);
	virtual_bench_fault(&r.b, "at=10ms lose");
	CHECK_EQ(virtual_master_run(&r.vm, 200), SESSION_GOES_ON);
	CHECK_EQ(r.vm.result.lost, 1);
	CHECK_EQ(r.vm.result.bad, 1);
	CHECK_EQ(r.vm.result.bad_unexplained, 0);
	CHECK_EQ(r.vm.result.skipped, 0);
	CHECK_EQ(r.vm.result.gaps, 0);
	CHECK_EQ(atomic_load(&r.stats->frames_lost), 1);
	CHECK_EQ(atomic_load(&r.stats->overruns), 0);
	CHECK(histogram_max_magnitude(&r.stats->work) < NS_PER_MS / 2);
	run_close(&r);
}

/* T05: a frame that comes one cycle late is never the data of that cycle. */
TEST(sim_frames, a_frame_one_cycle_late_is_counted_and_never_taken)
{
	static struct run r;

	run_open(&r);
	virtual_bench_fault(&r.b, "at=10ms delay by=1ms");
	CHECK_EQ(virtual_master_run(&r.vm, 200), SESSION_GOES_ON);
	CHECK_EQ(r.vm.result.lost, 1);
	CHECK_EQ(atomic_load(&r.stats->frames_late), 1);
	CHECK_EQ(r.vm.result.late, 1);
	CHECK_EQ(r.vm.result.bad_unexplained, 0);
	CHECK_EQ(r.vm.result.bad, 1); /* only the cycle whose frame it was */
	run_close(&r);
}

/* T06: even after the eight index bits have come round. */
TEST(sim_frames, a_frame_256_cycles_late_is_not_taken_for_the_current_one)
{
	static struct run r;

	run_open(&r);
	virtual_bench_fault(&r.b, "at=10ms delay by=256ms");
	CHECK_EQ(virtual_master_run(&r.vm, 600), SESSION_GOES_ON);
	CHECK_EQ(r.vm.result.lost, 1);
	CHECK_EQ(r.vm.result.bad, 1);
	CHECK_EQ(atomic_load(&r.stats->frames_late) + atomic_load(&r.stats->frames_foreign), 1);
	run_close(&r);
}

TEST(sim_frames, a_doubled_frame_is_counted_and_taken_once)
{
	static struct run r;

	run_open(&r);
	virtual_bench_fault(&r.b, "at=10ms double");
	CHECK_EQ(virtual_master_run(&r.vm, 200), SESSION_GOES_ON);
	CHECK_EQ(atomic_load(&r.stats->frames_doubled), 1);
	CHECK_EQ(r.vm.result.lost, 0);
	CHECK_EQ(r.vm.result.bad, 0);
	run_close(&r);
}

TEST(sim_frames, damaged_frames_are_dropped_and_their_data_is_not_used)
{
	static struct run r;

	run_open(&r);
	virtual_bench_fault(&r.b, "at=10ms truncate");
	virtual_bench_fault(&r.b, "at=20ms truncate");
	virtual_bench_fault(&r.b, "at=30ms drop");
	CHECK_EQ(virtual_master_run(&r.vm, 200), SESSION_GOES_ON);
	CHECK_EQ(r.vm.result.lost, 3);
	CHECK_EQ(r.vm.result.bad_unexplained, 0);
	/* A frame dropped before the slaves leaves a conversion unfetched: still one bad cycle
	 * each. */
	CHECK_EQ(r.vm.result.bad, 3);
	run_close(&r);
}

/* Every tenth frame late, doubled or lost for a while: counted to the last one, and OP is kept. */
TEST(sim_frames, a_storm_of_faults_is_counted_and_survived)
{
	static struct run r;

	run_open(&r);
	virtual_bench_fault(&r.b, "p=0.02 lose");
	virtual_bench_fault(&r.b, "p=0.02 delay by=700us");
	virtual_bench_fault(&r.b, "p=0.02 double");
	CHECK_EQ(virtual_master_run(&r.vm, 5000), SESSION_GOES_ON);
	CHECK_EQ(r.vm.result.gaps, 0);
	CHECK_EQ(r.vm.result.bad_unexplained, 0);
	CHECK(r.vm.result.lost > 100);
	CHECK_EQ(r.vm.result.lost, atomic_load(&r.stats->frames_lost));
	CHECK(atomic_load(&r.stats->frames_doubled) > 50);
	CHECK_EQ(atomic_load(&session_page(r.vm.session)->bus_state), BUS_OP);
	printf("%llu lost, %llu late, %llu doubled, %llu bad samples, none unexplained\n",
	       (unsigned long long)r.vm.result.lost,
	       (unsigned long long)atomic_load(&r.stats->frames_late),
	       (unsigned long long)atomic_load(&r.stats->frames_doubled),
	       (unsigned long long)r.vm.result.bad);
	run_close(&r);
}

TEST(sim_frames, a_cycle_delayed_by_five_periods_leaves_no_gap_in_the_numbers)
{
	static struct run r;

	run_open(&r);
	in_process_stall(r.b.host, 5 * NS_PER_MS + 100 * NS_PER_US);
	CHECK_EQ(virtual_master_run(&r.vm, 200), SESSION_GOES_ON);
	CHECK_EQ(r.vm.result.gaps, 0);
	CHECK_EQ(r.vm.result.skipped, 5);
	CHECK_EQ(r.vm.result.bad_unexplained, 0);
	CHECK_EQ(atomic_load(&r.stats->overruns), 1);
	CHECK_EQ(atomic_load(&r.stats->cycles_skipped), 5);
	CHECK_EQ(atomic_load(&session_page(r.vm.session)->bus_state), BUS_OP);
	run_close(&r);
}

/* The DC time is in the first frame; the inputs of the others may be those of the next edge. */
TEST(sim_frames, a_second_frame_behind_the_next_edge_makes_the_cycle_late_and_nothing_unexplained)
{
	static const char *const settings[] = { "cycle.period=2ms", NULL };
	static struct run r;

	virtual_bench_init(&r.b, &(struct virtual_spec){ .slaves = 96, .seed = 12 });
	virtual_master_init(&r.vm, &r.b, settings);
	CHECK_EQ(virtual_master_bring_up(&r.vm), 0);
	virtual_master_run(&r.vm, 100);
	r.stats = (struct cycle_stats *)&session_page(r.vm.session)->cycle;
	CHECK_EQ(atomic_load(&r.stats->frames_sent), 2 * atomic_load(&r.stats->cycles));
	virtual_master_forget(&r.vm);
	virtual_bench_fault(&r.b, "p=1 jitter by=500us");
	for (int i = 0; i < 200; i++) {
		in_process_stall(r.b.host, 600 * NS_PER_US);
		CHECK_EQ(virtual_master_run(&r.vm, 5), SESSION_GOES_ON);
	}
	CHECK(r.vm.result.late > 0);
	CHECK_EQ(r.vm.result.bad_unexplained, 0);
	run_close(&r);
}

TEST(sim_frames, a_segment_that_becomes_a_loop_is_named_and_recovered_from)
{
	static struct run r;

	run_open(&r);
	virtual_bench_fault(&r.b, "at=10ms for=500ms mirror");
	CHECK_EQ(virtual_master_run(&r.vm, 400), SESSION_GOES_ON);
	CHECK_EQ(atomic_load(&session_page(r.vm.session)->bus_state), BUS_RECOVERING);
	CHECK(strstr(session_page(r.vm.session)->message, "frames return unchanged") != NULL);
	CHECK(r.vm.result.lost > 300);
	CHECK_EQ(virtual_master_run(&r.vm, 4000), SESSION_GOES_ON);
	CHECK_EQ(atomic_load(&session_page(r.vm.session)->bus_state), BUS_OP);
	CHECK_STR(session_page(r.vm.session)->message, "");
	virtual_bench_fault(&r.b, "at=10ms for=300ms lose");
	CHECK_EQ(virtual_master_run(&r.vm, 200), SESSION_GOES_ON);
	CHECK(strstr(session_page(r.vm.session)->message, "unchanged") == NULL);
	run_close(&r);
}
