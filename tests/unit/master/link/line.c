/* SPDX-License-Identifier: MIT */
/* Direct mode, cancel, and what the line is set to. */
#include "link/line.h"

#include "unit/master/link/line_bench.h"

TEST(line, direct_transaction_returns_the_echo)
{
	struct fake_wire wire = { 0 };
	struct line *line = line_on(&wire);
	uint8_t answer[LIMIT_FRAME_BYTES];

	CHECK_EQ(ask_status(line, answer), 60);
	CHECK_EQ(answer[28], 1);
	CHECK_EQ(wire.now_ns, FAKE_TRAVEL_NS);
	CHECK_EQ(line_discarded(line), 0);
	CHECK_EQ(line_answered(line), 1);
	line_destroy(line);
}

TEST(line, lost_frame_costs_the_timeout_and_no_more)
{
	struct fake_wire wire = { .drop = 1 };
	struct line *line = line_on(&wire);
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES] = { 77 };
	size_t len = make_frame(frame, ECAT_CMD_BRD, 0, 0, 0);

	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 -ETIMEDOUT);
	CHECK_EQ(answer[0], 77);
	CHECK_EQ(wire.now_ns, 2000000);
	line_destroy(line);
}

TEST(line, answer_to_an_earlier_index_is_dropped)
{
	struct fake_wire wire = { 0 };
	struct line *line = line_on(&wire);
	uint8_t stale[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(stale, ECAT_CMD_FPRD, 6, 0x1001, ESC_REG_AL_STATUS);

	fake_pass_slave(stale, len);
	fake_queue(&wire, stale, len, 0);
	CHECK_EQ(ask_status(line, answer), len);
	CHECK_EQ(answer[17], 7);
	CHECK_EQ(line_discarded(line), 1);
	line_destroy(line);
}

TEST(line, flood_of_foreign_frames_costs_the_timeout_and_no_more)
{
	struct fake_wire wire = { .drop = 1, .flood_ns = 3000 };
	struct line *line = line_on(&wire);
	uint8_t answer[LIMIT_FRAME_BYTES];

	CHECK_EQ(ask_status(line, answer), -ETIMEDOUT);
	CHECK(wire.now_ns >= 2000000 && wire.now_ns <= 2003000);
	CHECK_EQ(line_discarded(line), wire.flooded);
	CHECK_EQ(ask_status(line, answer), 60);
	line_destroy(line);
}

static void shorten(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	(void)wire;
	fake_pass_slave(frame, len);
	frame[14] = (uint8_t)(frame[14] - 1);
}

static void mirror(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	(void)wire;
	(void)frame;
	(void)len;
}

static void readdress(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	(void)wire;
	fake_pass_slave(frame, len);
	frame[20] ^= 0x40;
}

static void check_refused(void (*answer_fn)(struct fake_wire *, uint8_t *, size_t))
{
	struct fake_wire wire = { .answer = answer_fn };
	struct line *line = line_on(&wire);
	uint8_t answer[LIMIT_FRAME_BYTES];

	CHECK_EQ(ask_status(line, answer), -ETIMEDOUT);
	CHECK_EQ(line_discarded(line), 1);
	line_destroy(line);
}

TEST(line, answer_of_another_length_is_refused)
{
	check_refused(shorten);
}

TEST(line, own_frame_mirrored_is_not_an_answer)
{
	check_refused(mirror);
}

TEST(line, answer_from_another_register_is_refused)
{
	check_refused(readdress);
}

TEST(line, broadcast_answer_may_carry_a_counted_position)
{
	struct fake_wire wire = { .drop = 1 };
	struct line *line = line_on(&wire);
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t back[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_BRD, 3, 0, 0);

	memcpy(back, frame, len);
	fake_pass_slave(back, len);
	back[18] = 3;
	fake_queue(&wire, back, len, 10);
	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }), len);
	line_destroy(line);
}

TEST(line, interface_down_is_reported_after_the_timeout)
{
	struct fake_wire wire = { .send_error = -ENETDOWN };
	struct line *line = line_on(&wire);
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_BRD, 0, 0, 0);

	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 -ENETDOWN);
	CHECK_EQ(wire.now_ns, 2000000);
	CHECK_EQ(line_transact(line, frame, 10, answer, sizeof(answer), (span_t){ 2000000 }),
		 -EINVAL);
	line_destroy(line);
}

/* --- cancel --- */

struct cancel {
	struct fake_wire *wire;
	int64_t at_ns;
};

static int is_cancelled(void *ctx)
{
	struct cancel *cancel = ctx;

	return cancel->wire->now_ns >= cancel->at_ns;
}

TEST(line, cancel_ends_a_sleep_and_a_transaction_within_10_ms)
{
	struct fake_wire wire = { .drop = 1 };
	struct line *line = line_on(&wire);
	struct cancel cancel = { &wire, 25 * NS_PER_MS };
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_BRD, 0, 0, 0);

	line_set_cancel(line, is_cancelled, &cancel);
	CHECK_EQ(line_sleep(line, (span_t){ 20 * NS_PER_MS }), 0);
	CHECK_EQ(line_sleep(line, (span_t){ NS_PER_S }), -ECANCELED);
	CHECK(wire.now_ns >= 25 * NS_PER_MS && wire.now_ns < 35 * NS_PER_MS);
	cancel.at_ns = 75 * NS_PER_MS;
	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ NS_PER_S }),
		 -ECANCELED);
	CHECK(wire.now_ns >= 75 * NS_PER_MS && wire.now_ns < 85 * NS_PER_MS);
	CHECK_EQ(wire.sent, 1);
	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ NS_PER_S }),
		 -ECANCELED);
	CHECK_EQ(wire.sent, 1);
	line_set_cancel(line, NULL, NULL);
	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ NS_PER_S }),
		 len);
	line_destroy(line);
}

TEST(line, cancel_withdraws_a_riding_frame)
{
	struct fake_wire wire = { 0 };
	struct ride ride;
	struct cancel cancel = { &wire, 5 * NS_PER_MS };
	uint8_t answer[LIMIT_FRAME_BYTES];

	begin_ride(&ride, &wire);
	ride.room.ns = 0;
	line_set_cancel(ride.line, is_cancelled, &cancel);
	CHECK_EQ(ask_status(ride.line, answer), -ECANCELED);
	CHECK_EQ(ride.cycles, 5);
	ride.room = ROOM;
	one_cycle(&ride, FOREVER);
	CHECK_EQ(wire.sent, 0);
	line_destroy(ride.line);
}

TEST(line, each_try_waits_longer_than_the_one_before)
{
	struct fake_wire wire = { 0 };
	struct line *line = line_on(&wire);

	CHECK_EQ(line_timeout(line, 0).ns, 2 * NS_PER_MS);
	line_timeout_set(line, (span_t){ 20 * NS_PER_MS });
	CHECK_EQ(line_timeout(line, 0).ns, 20 * NS_PER_MS);
	CHECK_EQ(line_timeout(line, 1).ns, 100 * NS_PER_MS);
	CHECK_EQ(line_timeout(line, LINE_TRIES - 1).ns, 500 * NS_PER_MS);
	line_destroy(line);
}

static void count_call(void *ctx)
{
	(*(unsigned *)ctx)++;
}

TEST(line, the_keepalive_is_called_for_every_frame_and_pause_even_on_a_dead_wire)
{
	struct fake_wire wire = { .drop = 1 };
	struct line *line = line_on(&wire);
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_BRD, 0, 0, 0);
	unsigned calls = 0;

	line_set_keepalive(line, count_call, &calls);
	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ NS_PER_MS }),
		 -ETIMEDOUT);
	CHECK_EQ(calls, 1);
	line_sleep(line, (span_t){ NS_PER_MS });
	CHECK_EQ(calls, 2);
	line_set_keepalive(line, NULL, NULL);
	line_sleep(line, (span_t){ NS_PER_MS });
	CHECK_EQ(calls, 2);
	line_destroy(line);
}
