/* SPDX-License-Identifier: MIT */
#include "cycle/numbering.h"

#include "harness/test.h"

#define PERIOD_NS 1000000

static struct numbering make(void)
{
	struct numbering n;

	numbering_init(&n, PERIOD_NS, 50000);
	numbering_place(&n, 10, 5000500000);
	return n;
}

TEST(numbering, the_first_frame_sets_the_grid_to_whole_periods)
{
	struct numbering n;

	numbering_init(&n, PERIOD_NS, 50000);
	CHECK_EQ(numbering_dc_time(&n, 10), 0);
	numbering_place(&n, 10, 5000500000);
	CHECK_EQ(numbering_dc_time(&n, 10), 5000000000);
	CHECK_EQ(numbering_dc_time(&n, 13), 5003000000);
}

TEST(numbering, a_frame_that_passes_after_the_next_edge_belongs_to_that_edge)
{
	struct numbering n = make();
	struct numbering_place p = numbering_place(&n, 11, 5001999999);

	CHECK_EQ(p.passed_edges, 0);
	CHECK(p.is_in_window);
	p = numbering_place(&n, 12, 5003500000);
	CHECK_EQ(p.passed_edges, 1);
	CHECK(p.is_in_window);
}

TEST(numbering, a_frame_right_after_an_edge_is_not_trusted)
{
	struct numbering n = make();

	CHECK(!numbering_place(&n, 11, 5001049999).is_in_window);
	CHECK(numbering_place(&n, 11, 5001050000).is_in_window);
	CHECK(!numbering_place(&n, 11, 5002010000).is_in_window);
}

TEST(numbering, a_frame_before_its_edge_is_not_trusted_and_never_counts_back)
{
	struct numbering n = make();
	struct numbering_place p = numbering_place(&n, 11, 5000990000);

	CHECK_EQ(p.passed_edges, 0);
	CHECK(!p.is_in_window);
}

TEST(numbering, another_reference_clock_rebases_the_grid_after_a_while)
{
	struct numbering n = make();
	struct numbering_place p;
	uint64_t cycle = 11;

	for (unsigned i = 1; i < NUMBERING_REBASE_CYCLES; i++, cycle++) {
		p = numbering_place(&n, cycle, 1000500000 + (int64_t)i * PERIOD_NS);
		CHECK(!p.is_in_window);
		CHECK(!p.was_rebased);
	}
	p = numbering_place(&n, cycle, 1200500000);
	CHECK(p.was_rebased);
	CHECK_EQ(numbering_dc_time(&n, cycle), 1200000000);
	CHECK(numbering_place(&n, cycle + 1, 1201500000).is_in_window);
}

TEST(numbering, a_late_wake_skips_exactly_the_edges_it_passed)
{
	CHECK_EQ(numbering_skipped(PERIOD_NS, 500000, 0), 0);
	CHECK_EQ(numbering_skipped(PERIOD_NS, 500000, 499999), 0);
	CHECK_EQ(numbering_skipped(PERIOD_NS, 500000, 500000), 1);
	CHECK_EQ(numbering_skipped(PERIOD_NS, 500000, 1499999), 1);
	CHECK_EQ(numbering_skipped(PERIOD_NS, 500000, 1500000), 2);
}
