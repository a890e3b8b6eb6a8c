/* SPDX-License-Identifier: MIT */
#include "bus/dc_topology.h"

#include <errno.h>

#include "harness/test.h"

enum { LINE = 0x3, END = 0x1, SPLIT = 0xb }; /* ports 0,1; 0; 0,1,3 */

static struct dc_node clock_node(uint8_t ports, uint32_t t0, uint32_t t1)
{
	return (struct dc_node){ .kind = CLOCK_SYSTEM_TIME,
				 .ports = ports,
				 .time_ns = { t0, t1, 0, 0 } };
}

/* EK1100, EL2828, EL2889 as captured: 600 and 310 ns round the tail, third slave 300 ns. */
TEST(dc_topology, captured_bus_gives_the_delays_seen)
{
	struct dc_node n[3] = { clock_node(LINE, 1000, 1600), clock_node(LINE, 70000, 70310),
				clock_node(END, 5, 0) };

	n[1].kind = CLOCK_RECEIVE_TIMES;
	CHECK_EQ(dc_topology_solve(n, 3), 0);
	CHECK_EQ(n[0].delay_ns, 0);
	CHECK_EQ(n[1].delay_ns, 145);
	CHECK_EQ(n[2].delay_ns, 300);
	CHECK_EQ(n[2].parent, 1);
	CHECK_EQ(n[2].parent_port, 1);
	CHECK_EQ(n[0].cable_ns, -1);
	CHECK_EQ(n[1].cable_ns, 145);
	CHECK_EQ(n[2].cable_ns, 155);
}

/* T13 */
TEST(dc_topology, delays_are_the_same_wherever_the_times_wrap)
{
	for (uint64_t start = 0xffffff00u; start < 0x100000200u; start += 7) {
		for (int half = 0; half < 2; half++) {
			uint32_t t = (uint32_t)start + (half ? 0x80000000u : 0);
			struct dc_node n[3] = { clock_node(LINE, t, t + 600),
						clock_node(LINE, t + 77, t + 387),
						clock_node(END, t, 0) };

			CHECK_EQ(dc_topology_solve(n, 3), 0);
			CHECK_EQ(n[0].entry_port, 0);
			CHECK_EQ(n[1].delay_ns, 145);
			CHECK_EQ(n[2].delay_ns, 300);
		}
	}
}

/* T14 */
TEST(dc_topology, slave_without_clock_between_is_stepped_over)
{
	struct dc_node n[3] = { clock_node(LINE, 1000, 1900),
				{ .kind = CLOCK_NONE, .ports = LINE },
				clock_node(END, 5, 0) };

	CHECK_EQ(dc_topology_solve(n, 3), 0);
	CHECK_EQ(n[1].delay_ns, 0);
	CHECK_EQ(n[2].delay_ns, 450);
	CHECK_EQ(n[1].cable_ns, -1);
	CHECK_EQ(n[2].cable_ns, -1);
}

TEST(dc_topology, slave_with_receive_times_only_is_never_the_reference)
{
	struct dc_node n[3] = { clock_node(LINE, 0, 600), clock_node(LINE, 0, 310),
				clock_node(END, 0, 0) };

	n[0].kind = CLOCK_RECEIVE_TIMES;
	CHECK_EQ(dc_topology_solve(n, 3), 1);
	CHECK_EQ(n[0].delay_ns, 0);
	CHECK_EQ(n[1].delay_ns, 0);
	CHECK_EQ(n[2].delay_ns, 155);
}

TEST(dc_topology, no_clock_no_reference)
{
	struct dc_node n[2] = { { .ports = LINE }, { .ports = END } };

	CHECK_EQ(dc_topology_solve(n, 2), -ENOENT);
	n[1].kind = CLOCK_RECEIVE_TIMES;
	CHECK_EQ(dc_topology_solve(n, 2), -ENOENT);
}

/* A split: the frame goes out at port 3 first (slave 1), then at port 1 (slave 2). */
TEST(dc_topology, second_branch_comes_after_the_first)
{
	struct dc_node n[3] = { clock_node(SPLIT, 1000, 2500), clock_node(END, 0, 0),
				clock_node(END, 0, 0) };

	n[0].time_ns[3] = 1800;
	CHECK_EQ(dc_topology_solve(n, 3), 0);
	CHECK_EQ(n[1].parent_port, 3);
	CHECK_EQ(n[2].parent, 0);
	CHECK_EQ(n[2].parent_port, 1);
	CHECK_EQ(n[1].delay_ns, 400);
	CHECK_EQ(n[2].delay_ns, 800 + 350);
}

/* The first branch has two slaves; the loop inside it is not counted as wire. */
TEST(dc_topology, loop_inside_a_branch_is_not_wire)
{
	struct dc_node n[4] = { clock_node(SPLIT, 0, 3000), clock_node(LINE, 0, 300),
				clock_node(END, 0, 0), clock_node(END, 0, 0) };

	n[0].time_ns[3] = 1000;
	CHECK_EQ(dc_topology_solve(n, 4), 0);
	CHECK_EQ(n[2].parent, 1);
	CHECK_EQ(n[3].parent, 0);
	CHECK_EQ(n[1].delay_ns, 350);
	CHECK_EQ(n[2].delay_ns, 350 + 150);
	CHECK_EQ(n[3].delay_ns, 1000 + 1000);
}

/* A clockless split in between: four wires of 100 ns, a clock at either end of it. */
TEST(dc_topology, clockless_split_shares_the_wire_evenly)
{
	struct dc_node n[4] = { clock_node(LINE, 0, 1000),
				{ .kind = CLOCK_NONE, .ports = SPLIT },
				clock_node(END, 0, 0),
				clock_node(LINE, 0, 400) };

	n[3].ports = END; /* nothing behind: its loop is 0 */
	CHECK_EQ(dc_topology_solve(n, 4), 0);
	CHECK_EQ(n[2].parent, 1);
	CHECK_EQ(n[3].parent, 1);
	CHECK_EQ(n[2].delay_ns, 1000 * 2 / 6);
	CHECK_EQ(n[3].delay_ns, 1000 * 4 / 6);
}

TEST(dc_topology, entry_by_another_port_is_found_by_the_earliest_time)
{
	struct dc_node n[2] = { clock_node(LINE, 0xfffffff0u, 0x200), clock_node(LINE, 900, 100) };

	n[1].ports = LINE;
	CHECK_EQ(dc_topology_solve(n, 2), 0);
	CHECK_EQ(n[1].entry_port, 1);
}

TEST(dc_topology, ports_that_make_no_tree_are_refused)
{
	struct dc_node n[3] = { clock_node(END, 0, 0), clock_node(END, 0, 0),
				clock_node(END, 0, 0) };

	CHECK_EQ(dc_topology_solve(n, 3), -EPROTO);
}

TEST(dc_topology, wild_times_give_no_negative_delay)
{
	uint32_t seed = 1;

	for (int k = 0; k < 20000; k++) {
		struct dc_node n[6];

		for (int i = 0; i < 6; i++) {
			n[i] = (struct dc_node){ 0 };
			seed = seed * 1664525u + 1013904223u;
			n[i].kind = (enum clock_kind)((seed >> 24) % 3);
			n[i].ports = (uint8_t)(1 | ((seed >> 20) & 0xe));
			for (int p = 0; p < DC_PORTS; p++) {
				seed = seed * 1664525u + 1013904223u;
				n[i].time_ns[p] = seed;
			}
		}
		if (dc_topology_solve(n, 6) >= 0) {
			for (int i = 0; i < 6; i++) {
				CHECK(n[i].delay_ns >= 0);
			}
		}
	}
}
