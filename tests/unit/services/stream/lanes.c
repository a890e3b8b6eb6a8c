/* SPDX-License-Identifier: MIT */
#include "stream/lanes.h"

#include <errno.h>
#include <string.h>

#include "harness/test.h"

enum { BYTES = 8, BLOCK = 4, SESSION = 4711 };

static struct lanes *lanes;
static struct broker_message message[2];

static void make(size_t memory_bytes)
{
	struct topics topics = { .session = SESSION };

	CHECK_EQ(topics_add(&topics, "a", "A", "int32 x\n"), 0);
	CHECK_EQ(topics_add(&topics, "b", "B", "int32 x\n"), 1);
	CHECK_EQ(lanes_create(&topics, "rig", &lanes), 0);
	lanes_set_bounds(lanes, &(struct lanes_bounds){ .block_cycles = BLOCK,
							.payload_bytes = 1000 * BYTES,
							.memory_bytes = memory_bytes });
	topics_done(&topics);
}

static int put(size_t lane, uint64_t cycle)
{
	return lanes_add(lanes, lane, cycle, &cycle, BYTES);
}

TEST(stream_lanes, a_block_says_which_cycles_it_has)
{
	make(1 << 20);
	for (uint64_t cycle = 10; cycle < 13; cycle++) {
		CHECK_EQ(put(0, cycle), 0);
	}
	CHECK(!lanes_are_due(lanes));
	CHECK_EQ(put(0, 13), 0);
	CHECK(lanes_are_due(lanes));
	CHECK_EQ(lanes_messages(lanes, message), 1);
	CHECK_STR(message[0].subject, "ecdaq.rig.a.block");
	CHECK_STR(message[0].id, "4711-0-10");
	CHECK_EQ(message[0].mark.value[MARK_SESSION], SESSION);
	CHECK_EQ(message[0].mark.value[MARK_FIRST_CYCLE], 10);
	CHECK_EQ(message[0].mark.value[MARK_NEXT_CYCLE], 14);
	CHECK_EQ(message[0].after, 0);
	CHECK_EQ(message[0].len, 4 * BYTES);
	message[0].sequence = 77;
	CHECK_EQ(lanes_stored(lanes, message, 1), 4 * BYTES);
	CHECK_EQ(put(0, 14), 0);
	CHECK_EQ(lanes_messages(lanes, message), 1);
	CHECK_EQ(message[0].after, 77);
	lanes_destroy(lanes);
}

TEST(stream_lanes, what_the_stream_has_is_not_taken_again)
{
	make(1 << 20);
	lanes_start(lanes, 0, (struct lane_start){ .sequence = 5, .next_cycle = 100 });
	lanes_start(lanes, 1, (struct lane_start){ .sequence = 6, .next_cycle = 98 });
	CHECK_EQ(lanes_next_cycle(lanes), 98);
	for (uint64_t cycle = 95; cycle < 102; cycle++) {
		CHECK_EQ(put(0, cycle), 0);
		CHECK_EQ(put(1, cycle), 0);
	}
	CHECK_EQ(put(0, 101), 0);
	CHECK_EQ(lanes_messages(lanes, message), 2);
	CHECK_EQ(message[0].mark.value[MARK_FIRST_CYCLE], 100);
	CHECK_EQ(message[1].mark.value[MARK_FIRST_CYCLE], 98);
	CHECK_EQ(message[0].len, 2 * BYTES);
	CHECK_EQ(message[1].len, 4 * BYTES);
	lanes_destroy(lanes);
}

TEST(stream_lanes, a_gap_and_another_size_begin_another_block)
{
	uint8_t longer[2 * BYTES] = { 0 };

	make(1 << 20);
	CHECK_EQ(put(0, 1), 0);
	CHECK_EQ(put(0, 3), -EAGAIN);
	CHECK(lanes_are_full(lanes));
	CHECK_EQ(lanes_messages(lanes, message), 1);
	CHECK_EQ(message[0].mark.value[MARK_NEXT_CYCLE], 2);
	lanes_stored(lanes, message, 1);
	CHECK(!lanes_are_full(lanes));
	CHECK_EQ(put(0, 3), 0);
	CHECK_EQ(lanes_add(lanes, 0, 4, longer, sizeof(longer)), -EAGAIN);
	lanes_destroy(lanes);
}

TEST(stream_lanes, memory_and_payload_are_bounded)
{
	static uint8_t longest[1000 * BYTES + 1];
	uint64_t cycle = 0;

	make(64 * BYTES);
	while (put(0, cycle) == 0) {
		cycle++;
	}
	CHECK_EQ(cycle, 64);
	CHECK_EQ(lanes_add(lanes, 1, 0, longest, sizeof(longest)), -EMSGSIZE);
	lanes_destroy(lanes);
}
