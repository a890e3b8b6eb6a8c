/* SPDX-License-Identifier: MIT */
/* A flood of unexpected frames, faster than they can be read: the deadline is kept. */
#include "bus/exchange.h"

#include "unit/master/bus/exchange_bench.h"

enum { FLOOD_NS = 1000 };

static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };

TEST(exchange, flood_of_foreign_frames_costs_the_deadline_and_no_more)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	struct exchange_result res;
	int64_t over_ns;

	CHECK_EQ(run(b).status, EXCHANGE_OK);
	b->wire.flood_ns = FLOOD_NS;
	b->wire.drop = 1;
	res = run(b);
	over_ns = b->wire.now_ns % PERIOD_NS - DEADLINE_NS;
	CHECK_EQ(res.status, EXCHANGE_NO_FRAME);
	CHECK(over_ns >= 0 && over_ns <= FLOOD_NS);
	CHECK_EQ(res.foreign, b->wire.flooded);
	CHECK_EQ(res.foreign, DEADLINE_NS / FLOOD_NS);
	bench_destroy(b);
}

TEST(exchange, own_frame_is_found_in_a_flood)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	struct exchange_result res;

	b->wire.flood_ns = FLOOD_NS;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_OK);
	CHECK_EQ(res.foreign, FAKE_TRAVEL_NS / FLOOD_NS);
	bench_destroy(b);
}

TEST(exchange, frame_that_waits_while_the_thread_slept_past_its_deadline_is_taken)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);

	run(b);
	b->wire.travel_ns = 0;
	CHECK_EQ(exchange_run(b->ex, b->image, (mono_t){ b->wire.now_ns - 1 }).status, EXCHANGE_OK);
	bench_destroy(b);
}

static void ride_in_flood(void *ctx, mono_t until)
{
	struct bench *b = ctx;
	mono_t deadline;

	(void)until;
	b->wire.flood_ns = 0;
	b->wire.drop = 0;
	CHECK_EQ(run(b).status, EXCHANGE_OK);
	b->wire.flood_ns = FLOOD_NS;
	b->wire.drop = 1;
	deadline = (mono_t){ b->wire.now_ns + DEADLINE_NS };
	exchange_ride(b->ex, &(struct exchange_window){ .period = { NS_PER_MS },
							.wire_needed = deadline,
							.listen_until = deadline });
	CHECK(b->wire.now_ns <= deadline.ns + FLOOD_NS);
	CHECK(b->wire.now_ns >= deadline.ns || !line_ride_is_out(b->line));
}

TEST(exchange, ride_whose_answer_is_lost_in_a_flood_ends_with_its_deadline)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	struct ecat_frame_builder fb;
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];

	line_ride_begin(b->line, (struct line_waiter){ ride_in_flood, b });
	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, ECAT_CMD_BRD, 200, 0, 0x0130, 2);
	CHECK_EQ(line_transact(b->line, frame, ecat_frame_end(&fb), answer, sizeof(answer),
			       (span_t){ 1000000 }),
		 -ETIMEDOUT);
	CHECK(b->wire.flooded > 0);
	bench_destroy(b);
}
