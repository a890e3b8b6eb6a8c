/* SPDX-License-Identifier: MIT */
/* A ring: frames from either port of the master, whole and cut at every place. */
#include <errno.h>

#include "bench.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum { SLAVES = 4, RING_WIRE_NS = 5 };

static struct bench *ring(void)
{
	const struct bench_slave slaves[SLAVES] = {
		{ .pdi = 5 }, { .pdi = 5 }, { .pdi = 5 }, { .pdi = 5 }
	};
	struct bench *b = bench_create(slaves, SLAVES);

	CHECK_EQ(segment_close_ring(b->segment, SLAVES - 1, 1, RING_WIRE_NS), 0);
	return b;
}

/* A broadcast read from one port; where it came back, and how many slaves took part. */
struct pass {
	int result;
	enum segment_port back;
	uint16_t wkc;
	uint8_t source;
};

static struct pass send_from(struct bench *b, enum segment_port from)
{
	static const uint8_t source[6] = { 0x10 };
	struct segment_return back = { .port = SEGMENT_PORTS };
	struct ecat_frame_builder fb;
	struct pass p;
	uint8_t *data;

	ecat_frame_begin(&fb, b->frame, source);
	data = ecat_frame_add(&fb, ECAT_CMD_BRD, 0, 0, ESC_REG_TYPE, 1);
	b->frame_len = ecat_frame_end(&fb);
	b->now_ns += BENCH_STEP_NS;
	p.result = segment_frame_from(b->segment, from, b->now_ns, b->frame, b->frame_len, &back);
	p.back = back.port;
	p.wkc = data[1];
	p.source = b->frame[6];
	return p;
}

TEST(ring, a_frame_goes_round_and_comes_back_at_the_other_port)
{
	struct bench *b = ring();
	struct pass p = send_from(b, SEGMENT_PRIMARY);

	CHECK_EQ(p.result, 0);
	CHECK_EQ(p.back, SEGMENT_SECONDARY);
	CHECK_EQ(p.wkc, SLAVES);
	/* The other way round it meets no processing unit. */
	p = send_from(b, SEGMENT_SECONDARY);
	CHECK_EQ(p.result, 0);
	CHECK_EQ(p.back, SEGMENT_PRIMARY);
	CHECK_EQ(p.wkc, 0);
	CHECK_EQ(p.source, 0x10);
	bench_destroy(b);
}

TEST(ring, cut_anywhere_both_ports_together_reach_every_slave)
{
	for (size_t cut = 0; cut <= SLAVES; cut++) {
		struct bench *b = ring();
		struct pass primary;
		struct pass secondary;

		if (cut < SLAVES) {
			segment_cut(b->segment, cut, b->now_ns);
		} else {
			segment_cut_ring(b->segment, b->now_ns);
		}
		CHECK_EQ(segment_is_up(b->segment, SEGMENT_PRIMARY), cut != 0);
		CHECK_EQ(segment_is_up(b->segment, SEGMENT_SECONDARY), cut != SLAVES);
		primary = send_from(b, SEGMENT_PRIMARY);
		secondary = send_from(b, SEGMENT_SECONDARY);
		CHECK_EQ(primary.result, cut == 0 ? -ENOLINK : 0);
		CHECK_EQ(secondary.result, cut == SLAVES ? -ENOLINK : 0);
		if (cut != 0) {
			CHECK_EQ(primary.back, SEGMENT_PRIMARY);
			CHECK_EQ(primary.wkc, cut);
		}
		if (cut != SLAVES) {
			CHECK_EQ(secondary.back, SEGMENT_SECONDARY);
			CHECK_EQ(secondary.wkc, SLAVES - cut);
		}
		bench_destroy(b);
	}
}

TEST(ring, healed_it_is_whole_again)
{
	struct bench *b = ring();

	segment_cut(b->segment, 2, b->now_ns);
	segment_cut_ring(b->segment, b->now_ns);
	CHECK_EQ(send_from(b, SEGMENT_PRIMARY).wkc, 2);
	segment_heal(b->segment, 2, b->now_ns);
	segment_heal_ring(b->segment, b->now_ns);
	CHECK_EQ(send_from(b, SEGMENT_PRIMARY).back, SEGMENT_SECONDARY);
	CHECK_EQ(segment_esc(b->segment, 3)->reg[ESC_REG_LOST_LINK_COUNTER + 1], 1);
	bench_destroy(b);
}

TEST(ring, a_slave_without_power_cuts_it_twice)
{
	struct bench *b = ring();

	segment_power_off(b->segment, 1, b->now_ns);
	CHECK_EQ(send_from(b, SEGMENT_PRIMARY).wkc, 1);
	CHECK_EQ(send_from(b, SEGMENT_SECONDARY).wkc, 2);
	bench_destroy(b);
}

TEST(ring, it_closes_at_a_free_port_only_and_once)
{
	struct bench *b = ring();

	CHECK_EQ(segment_close_ring(b->segment, 3, 2, RING_WIRE_NS), -EINVAL);
	bench_destroy(b);
	b = bench_create_one();
	CHECK_EQ(segment_close_ring(b->segment, 0, 0, RING_WIRE_NS), -EINVAL);
	CHECK_EQ(segment_close_ring(b->segment, 1, 1, RING_WIRE_NS), -EINVAL);
	CHECK_EQ(segment_close_ring(b->segment, 0, 4, RING_WIRE_NS), -EINVAL);
	CHECK_EQ(segment_is_up(b->segment, SEGMENT_SECONDARY), 0);
	bench_destroy(b);
}
