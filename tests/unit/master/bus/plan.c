/* SPDX-License-Identifier: MIT */
#include "bus/plan.h"

#include <errno.h>

#include "base/slave_set.h"
#include "bus/exchange_frame.h"
#include "harness/test.h"

static struct exchange_plan plan_of(uint32_t bytes)
{
	return (struct exchange_plan){ .image_bytes = bytes, .dc_reference = 0x1001, .monitor = 1 };
}

static struct plan_area area_of(uint32_t start, uint32_t end, uint16_t slave, int is_output)
{
	return (struct plan_area){
		.start = start, .end = end, .slave_pos = slave, .is_output = (uint8_t)is_output
	};
}

TEST(plan, lrw_counts_two_for_written_and_one_for_read)
{
	struct exchange_plan plan = plan_of(44);
	const struct plan_area area[] = { area_of(0, 9, 0, 1), area_of(9, 18, 1, 1),
					  area_of(18, 31, 0, 0), area_of(31, 44, 1, 0) };
	int blocked;

	CHECK_EQ(plan_chunks(&plan, area, 4, &blocked), 0);
	CHECK_EQ(plan.chunk_count, 1);
	CHECK_EQ(plan.chunk_bytes[0], 44);
	CHECK_EQ(plan.wkc_expected, 6);
}

/* SOEM is wrong here: slaves that share a byte are counted each. */
TEST(plan, slaves_that_share_a_byte_count_each)
{
	struct exchange_plan plan = plan_of(1);
	const struct plan_area area[] = { area_of(0, 1, 0, 1), area_of(0, 1, 1, 1),
					  area_of(0, 1, 2, 1) };
	int blocked;

	CHECK_EQ(plan_chunks(&plan, area, 3, &blocked), 0);
	CHECK_EQ(plan.wkc_expected, 6);
}

TEST(plan, slave_with_two_managers_of_one_kind_counts_once)
{
	struct exchange_plan plan = plan_of(2);
	const struct plan_area area[] = { area_of(0, 1, 0, 1), area_of(1, 2, 0, 1) };
	int blocked;

	CHECK_EQ(plan_chunks(&plan, area, 2, &blocked), 0);
	CHECK_EQ(plan.wkc_expected, 2);
}

/* T41 */
TEST(plan, no_buffer_is_split_between_frames)
{
	struct exchange_plan plan = plan_of(3000);
	const struct plan_area area[] = { area_of(0, 1000, 0, 1), area_of(1000, 2000, 1, 1),
					  area_of(2000, 3000, 2, 0) };
	int blocked;

	CHECK_EQ(plan_chunks(&plan, area, 3, &blocked), 0);
	CHECK_EQ(plan.chunk_count, 3);
	CHECK_EQ(plan.chunk_bytes[0], 1000);
	CHECK_EQ(plan.chunk_bytes[2], 1000);
	CHECK_EQ(plan.chunk_wkc[0], 2);
	CHECK_EQ(plan.chunk_wkc[2], 1);
	CHECK_EQ(plan.wkc_expected, 5);
}

TEST(plan, frames_are_filled_up_to_what_they_hold)
{
	struct exchange_plan plan = plan_of(1436 + 100);
	struct plan_area area[16];
	int blocked;

	for (unsigned i = 0; i < 16; i++) {
		area[i] = area_of(i * 96, i * 96 + 96, (uint16_t)i, 0);
	}
	CHECK_EQ(plan_chunks(&plan, area, 16, &blocked), 0);
	CHECK_EQ(plan.chunk_count, 2);
	CHECK_EQ(plan.chunk_bytes[0], 14 * 96);
	CHECK_EQ(plan.chunk_wkc[0], 14);
	CHECK_EQ(plan.chunk_wkc[1], 2);
}

TEST(plan, buffer_larger_than_a_frame_is_named)
{
	struct exchange_plan plan = plan_of(2000);
	const struct plan_area area[] = { area_of(0, 100, 0, 1), area_of(100, 2000, 1, 1) };
	int blocked = -1;

	CHECK_EQ(plan_chunks(&plan, area, 2, &blocked), -E2BIG);
	CHECK_EQ(blocked, 1);
}

TEST(plan, more_frames_than_the_limit_are_refused)
{
	enum { AREAS = LIMIT_FRAMES + 1 };
	struct exchange_plan plan = plan_of(LIMIT_FRAMES * 1400);
	struct plan_area area[AREAS];
	int blocked = 5;

	for (unsigned i = 0; i < AREAS; i++) {
		area[i] = area_of(i * 1400, i * 1400 + 1400, (uint16_t)i, 0);
	}
	CHECK_EQ(plan_chunks(&plan, area, LIMIT_FRAMES, &blocked), 0);
	plan = plan_of(AREAS * 1400);
	CHECK_EQ(plan_chunks(&plan, area, AREAS, &blocked), -E2BIG);
	CHECK_EQ(blocked, -1);
}

TEST(plan, nothing_mapped_needs_no_datagram)
{
	struct exchange_plan plan = plan_of(0);
	int blocked;

	CHECK_EQ(plan_chunks(&plan, NULL, 0, &blocked), 0);
	CHECK_EQ(plan.chunk_count, 0);
	CHECK_EQ(plan.wkc_expected, 0);
}

TEST(plan, split_gives_each_slave_its_own_datagrams_in_one_frame)
{
	struct exchange_plan plan = plan_of(44);
	const struct plan_area area[] = { area_of(0, 9, 0, 1), area_of(9, 18, 1, 1),
					  area_of(18, 31, 0, 0), area_of(31, 44, 1, 0) };
	int blocked;

	plan.is_split = 1;
	CHECK_EQ(plan_chunks(&plan, area, 4, &blocked), 0);
	CHECK_EQ(plan.chunk_count, 4);
	CHECK_EQ(plan.wkc_expected, 6);
	for (unsigned i = 0; i < 4; i++) {
		CHECK_EQ(plan.chunk_bytes[i], area[i].end - area[i].start);
		CHECK_EQ(plan.chunk_wkc[i], i < 2 ? 2 : 1);
		CHECK_EQ(plan.chunk_slaves[i].word[0], 1u << (i % 2));
		CHECK_EQ(plan.chunk_frame[i], 0);
	}
}

TEST(plan, split_keeps_together_what_shares_a_byte_or_is_one_slave_s)
{
	struct exchange_plan plan = plan_of(12);
	/* Two slaves with four bits each in byte 0; a third with two SMs; a byte without an owner.
	 */
	const struct plan_area area[] = { area_of(0, 1, 0, 1), area_of(0, 1, 1, 1),
					  area_of(1, 5, 2, 1), area_of(5, 8, 2, 0),
					  area_of(9, 12, 3, 0) };
	int blocked;

	plan.is_split = 1;
	CHECK_EQ(plan_chunks(&plan, area, 5, &blocked), 0);
	CHECK_EQ(plan.chunk_count, 3);
	CHECK_EQ(plan.chunk_bytes[0], 1);
	CHECK_EQ(plan.chunk_slaves[0].word[0], 3);
	CHECK_EQ(plan.chunk_wkc[0], 4);
	CHECK_EQ(plan.chunk_bytes[1], 8);
	CHECK_EQ(plan.chunk_slaves[1].word[0], 4);
	CHECK_EQ(plan.chunk_wkc[1], 3);
	CHECK_EQ(plan.chunk_bytes[2], 3);
	CHECK_EQ(plan.chunk_slaves[2].word[0], 8);
}

TEST(plan, split_fills_frames_in_order_up_to_the_greatest_bus)
{
	enum { OUT = 8, IN = 56, INPUTS = LIMIT_SLAVES * OUT };
	struct exchange_plan plan = plan_of(LIMIT_IMAGE_BYTES);
	static struct plan_area area[2 * LIMIT_SLAVES];
	struct exchange_frame frame;
	uint32_t bytes = 0;
	int blocked;

	for (unsigned i = 0; i < LIMIT_SLAVES; i++) {
		area[i] = area_of(i * OUT, i * OUT + OUT, (uint16_t)i, 1);
		area[LIMIT_SLAVES + i] =
			area_of(INPUTS + i * IN, INPUTS + i * IN + IN, (uint16_t)i, 0);
	}
	plan.is_split = 1;
	CHECK_EQ(plan_chunks(&plan, area, 2 * LIMIT_SLAVES, &blocked), 0);
	CHECK_EQ(plan.chunk_count, 2 * LIMIT_SLAVES);
	CHECK_EQ(plan.wkc_expected, 3 * LIMIT_SLAVES);
	CHECK_EQ(slave_set_count(&plan.chunk_slaves[LIMIT_SLAVES + 300]), 1);
	CHECK(slave_set_has(&plan.chunk_slaves[LIMIT_SLAVES + 300], 300));
	CHECK_EQ(exchange_frame_count(&plan), 32);
	for (unsigned n = 0; n < exchange_frame_count(&plan); n++) {
		CHECK_EQ(exchange_frame_build(&plan, n, &frame), 0);
		CHECK(frame.len <= LIMIT_FRAME_BYTES);
		for (unsigned i = 0; i < frame.part_count; i++) {
			CHECK_EQ(frame.part[i].offset, bytes);
			bytes += frame.part[i].len;
		}
	}
	CHECK_EQ(bytes, plan.image_bytes);
}

/* Outputs of two slaves, then their inputs; slave 1 does not support LRW. */
static struct exchange_plan plan_without_lrw(uint32_t bytes, int is_split)
{
	const uint32_t q = bytes / 4;
	struct plan_area area[] = { area_of(0, q, 0, 1), area_of(q, 2 * q, 1, 1),
				    area_of(2 * q, 3 * q, 0, 0), area_of(3 * q, bytes, 1, 0) };
	struct exchange_plan plan = plan_of(bytes);
	int blocked;

	plan.output_bytes = 2 * q;
	plan.is_split = is_split;
	area[1].is_lrw_forbidden = 1;
	area[3].is_lrw_forbidden = 1;
	CHECK_EQ(plan_chunks(&plan, area, 4, &blocked), 0);
	return plan;
}

TEST(plan, a_slave_that_forbids_lrw_gets_lwr_and_lrd_in_one_frame)
{
	struct exchange_plan plan = plan_without_lrw(40, 0);

	CHECK_EQ(plan.chunk_count, 2);
	CHECK_EQ(exchange_frame_count(&plan), 1);
	CHECK_EQ(plan.chunk_kind[0], EXCHANGE_LWR);
	CHECK_EQ(plan.chunk_bytes[0], 20);
	CHECK_EQ(plan.chunk_wkc[0], 2);
	CHECK_EQ(plan.chunk_kind[1], EXCHANGE_LRD);
	CHECK_EQ(plan.chunk_bytes[1], 20);
	CHECK_EQ(plan.chunk_wkc[1], 2);
	CHECK_EQ(plan.wkc_expected, 4);
}

TEST(plan, long_outputs_and_inputs_without_lrw_take_frames_of_their_own)
{
	struct exchange_plan plan = plan_without_lrw(2800, 0);

	CHECK_EQ(plan.chunk_count, 2);
	CHECK_EQ(exchange_frame_count(&plan), 2);
	CHECK_EQ(plan.chunk_kind[0], EXCHANGE_LWR);
	CHECK_EQ(plan.chunk_kind[1], EXCHANGE_LRD);
}

TEST(plan, with_a_datagram_per_slave_the_others_keep_lrw)
{
	static const uint8_t kind[] = { EXCHANGE_LRW, EXCHANGE_LWR, EXCHANGE_LRW, EXCHANGE_LRD };
	static const uint16_t wkc[] = { 2, 1, 1, 1 };
	struct exchange_plan plan = plan_without_lrw(40, 1);

	CHECK_EQ(plan.chunk_count, 4);
	for (unsigned i = 0; i < 4; i++) {
		CHECK_EQ(plan.chunk_kind[i], kind[i]);
		CHECK_EQ(plan.chunk_wkc[i], wkc[i]);
	}
}
