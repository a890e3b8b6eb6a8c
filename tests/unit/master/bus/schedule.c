/* SPDX-License-Identifier: MIT */
#include "bus/schedule.h"

#include "base/clock.h"
#include "bus/exchange_frame.h"
#include "harness/test.h"
#include "wire/datagram.h"

enum { RECEIVE_PERCENT = 40 };

static struct exchange_plan plan_of(uint32_t bytes)
{
	struct exchange_plan plan = { .image_bytes = bytes, .dc_reference = 0x1001, .monitor = 1 };

	while (bytes > 0) {
		uint32_t room = exchange_frame_capacity(&plan, plan.chunk_count);
		uint32_t len = bytes < room ? bytes : room;

		plan.chunk_bytes[plan.chunk_count] = len;
		plan.chunk_frame[plan.chunk_count] = (uint8_t)plan.chunk_count;
		plan.chunk_count++;
		bytes -= len;
	}
	return plan;
}

/* A line: what slave 0 latches when the frame leaves at port 1's wire and comes back. */
static struct dc_node first_of_line(int64_t behind_ns)
{
	return (struct dc_node){
		.kind = CLOCK_SYSTEM_TIME,
		.ports = 3,
		.time_ns = { UINT32_MAX - 100, (uint32_t)(UINT32_MAX - 100 + behind_ns), 7, 7 },
	};
}

static void check_length(const struct exchange_plan *plan)
{
	static struct exchange_frame frame;

	for (unsigned i = 0; i < exchange_frame_count(plan); i++) {
		CHECK_EQ(exchange_frame_build(plan, i, &frame), 0);
		CHECK_EQ(exchange_frame_bytes(plan, i), frame.len);
	}
}

TEST(schedule, the_length_of_a_frame_is_known_without_building_it)
{
	struct exchange_plan plan = { 0 };

	check_length(&plan);
	for (uint32_t bytes = 1; bytes < 4000; bytes += 97) {
		plan = plan_of(bytes);
		check_length(&plan);
		plan.monitor = 0;
		check_length(&plan);
		plan.dc_reference = 0;
		plan = (struct exchange_plan){ .image_bytes = 60,
					       .chunk_bytes = { 20, 40 },
					       .chunk_count = 2 };
		check_length(&plan);
	}
}

TEST(schedule, bytes_and_latched_path_are_the_time_of_the_frames)
{
	struct exchange_plan plan = plan_of(1000);
	struct dc_node node[3] = { first_of_line(5000) };
	struct schedule sc = schedule_compute(&plan, node, 3, NS_PER_MS, RECEIVE_PERCENT);

	CHECK_EQ(sc.wire_ns, ecat_wire_time_ns(exchange_frame_bytes(&plan, 0)));
	CHECK_EQ(sc.path_ns, 1000 + 5000);
	CHECK_EQ(sc.need_ns, sc.wire_ns + sc.path_ns + 10000);
	CHECK_EQ(sc.allowed_ns, 400000);
	CHECK_EQ(sc.service_frame_bytes,
		 (950000 - sc.need_ns - sc.path_ns) / ECAT_BYTE_NS - ECAT_UNSEEN_BYTES);
}

TEST(schedule, slaves_without_receive_times_count_a_microsecond_each)
{
	struct exchange_plan plan = plan_of(100);
	struct dc_node node[4] = { { .kind = CLOCK_NONE }, { .kind = CLOCK_NONE } };

	CHECK_EQ(schedule_compute(&plan, node, 4, NS_PER_MS, RECEIVE_PERCENT).path_ns, 5000);
	node[2] = first_of_line(3000);
	CHECK_EQ(schedule_compute(&plan, node, 4, NS_PER_MS, RECEIVE_PERCENT).path_ns, 6000);
}

TEST(schedule, the_smallest_period_is_enough_and_ten_microseconds_less_is_not)
{
	struct dc_node node = first_of_line(30000);

	for (uint32_t bytes = 10; bytes < 8000; bytes += 333) {
		struct exchange_plan plan = plan_of(bytes);
		struct schedule sc = schedule_compute(&plan, &node, 1, NS_PER_MS, RECEIVE_PERCENT);
		struct schedule at =
			schedule_compute(&plan, &node, 1, sc.smallest_period_ns, RECEIVE_PERCENT);
		struct schedule below = schedule_compute(
			&plan, &node, 1, sc.smallest_period_ns - 10000, RECEIVE_PERCENT);

		CHECK(at.need_ns <= at.allowed_ns);
		CHECK(at.service_frame_bytes >= 256);
		CHECK(below.need_ns > below.allowed_ns || below.service_frame_bytes < 256);
	}
}

TEST(schedule, a_long_receive_share_still_leaves_room_for_a_service_frame)
{
	struct exchange_plan plan = plan_of(2000);
	struct dc_node node = first_of_line(30000);
	struct schedule sc = schedule_compute(&plan, &node, 1, NS_PER_MS, 95);

	CHECK(sc.smallest_period_ns * 95 / 100 >= sc.need_ns + sc.path_ns + ecat_wire_time_ns(256));
}
