/* SPDX-License-Identifier: MIT */
/* The reference clock in the cyclic frame: followed, lost, back, implausible. */
#include "bus/exchange_dc.h"

#include "base/prng.h"
#include "unit/master/bus/exchange_bench.h"

static uint8_t dc_command(const struct bench *b)
{
	return b->wire.last_sent.bytes[56];
}

TEST(exchange, frmw_carries_where_the_reference_should_be)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);

	run(b);
	CHECK_EQ(dc_command(b), ECAT_CMD_FPRD);
	run(b);
	CHECK_EQ(dc_command(b), ECAT_CMD_FRMW);
	CHECK_EQ(get_le64(b->wire.last_sent.bytes + 66), b->dc_offset_ns + 2 * PERIOD_NS);
	bench_destroy(b);
}

TEST(exchange, frmw_stops_while_the_reference_is_lost_and_resumes_with_it)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);

	run(b);
	run(b);
	b->dc_wkc = 0;
	CHECK_EQ(run(b).dc_time_ns, 0);
	CHECK_EQ(run(b).dc_time_ns, 0);
	CHECK_EQ(dc_command(b), ECAT_CMD_FPRD);
	b->dc_wkc = 1;
	CHECK(run(b).dc_time_ns > 0);
	run(b);
	CHECK_EQ(dc_command(b), ECAT_CMD_FRMW);
	bench_destroy(b);
}

TEST(exchange, reference_that_returns_with_another_time_is_not_passed_on)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);

	run(b);
	run(b);
	b->dc_offset_ns = 0; /* power cycled */
	for (int i = 0; i < 100; i++) {
		CHECK_EQ(run(b).dc_time_ns, 0);
	}
	CHECK_EQ(dc_command(b), ECAT_CMD_FPRD);
	b->dc_offset_ns = INT64_C(800000000000000000); /* set again by the service */
	CHECK(run(b).dc_time_ns > 0);
	bench_destroy(b);
}

/* D1: after a while another device's clock was followed. */
TEST(exchange, a_rejected_time_is_never_used_until_the_reference_was_identified)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);

	run(b);
	run(b);
	b->dc_offset_ns += NS_PER_S;
	CHECK_EQ(exchange_doubts_reference(b->ex), 0);
	for (int i = 0; i < 20000; i++) {
		CHECK_EQ(run(b).dc_time_ns, 0);
	}
	CHECK_EQ(exchange_doubts_reference(b->ex), 1);
	exchange_confirm_reference(b->ex);
	CHECK(run(b).dc_time_ns > 0);
	CHECK_EQ(exchange_doubts_reference(b->ex), 0);
	/* It is confirmed once. */
	b->dc_offset_ns += NS_PER_S;
	for (int i = 0; i < 2000; i++) {
		CHECK_EQ(run(b).dc_time_ns, 0);
	}
	bench_destroy(b);
}

static void answer_by_two(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	struct ecat_datagram dg;
	size_t pos = 0;

	play_slaves(wire, frame, len);
	while (ecat_frame_next(frame, len, &pos, &dg) == 1) {
		if (dg.cmd == ECAT_CMD_FPRD) {
			put_le16(dg.wkc, 2);
		}
	}
}

TEST(exchange, a_time_that_two_devices_answered_is_none)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);

	b->wire.answer = answer_by_two;
	CHECK_EQ(run(b).dc_time_ns, 0);
	b->wire.answer = play_slaves;
	CHECK(run(b).dc_time_ns > 0);
	bench_destroy(b);
}

/* Slaves behind the reference still count when it is lost: the payload comes back unchanged. */
static void answer_without_reference(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	struct bench *b = wire->user;
	struct ecat_datagram dg;
	uint8_t payload[8];
	size_t pos = 0;

	memcpy(payload, frame + 66, 8);
	play_slaves(wire, frame, len);
	while (ecat_frame_next(frame, len, &pos, &dg) == 1) {
		if (dg.cmd == ECAT_CMD_FRMW) {
			memcpy(dg.data, payload, 8);
			put_le16(dg.wkc, (uint16_t)(b->dc_wkc - 1));
		} else if (dg.cmd == ECAT_CMD_FPRD) {
			memset(dg.data, 0, 8);
			put_le16(dg.wkc, 0);
		}
	}
}

TEST(exchange, payload_that_no_slave_overwrote_ends_with_the_next_frame)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);

	b->dc_wkc = 3;
	run(b);
	run(b);
	run(b);
	b->wire.answer = answer_without_reference;
	CHECK_EQ(run(b).dc_time_ns, b->dc_offset_ns + 4 * PERIOD_NS); /* as predicted */
	for (int i = 0; i < 10; i++) {
		CHECK_EQ(run(b).dc_time_ns, 0);
		CHECK_EQ(dc_command(b), ECAT_CMD_FPRD);
	}
	b->wire.answer = play_slaves;
	CHECK(run(b).dc_time_ns > 0);
	run(b);
	CHECK_EQ(dc_command(b), ECAT_CMD_FRMW);
	bench_destroy(b);
}

/* Sum of twelve even ones: about a standard normal distribution. */
static double noise(struct prng *prng)
{
	double sum = -6;

	for (int i = 0; i < 12; i++) {
		sum += prng_unit(prng);
	}
	return sum;
}

enum { JITTER_CYCLES = 100000, GRAIN_NS = 10 };

/* One of three slaves is lost, and transit jitter makes the reference's answer equal the
 * prediction now and then. */
static void check_jitter(int64_t sigma_ns)
{
	struct dc_track track = { 0 };
	struct prng prng = { .state = (uint64_t)sigma_ns };
	mono_t at = { 0 };
	int64_t payload;
	unsigned coincidences = 0;
	unsigned following = 0;

	dc_track_command(&track, at, &payload);
	dc_track_answer(&track, ECAT_CMD_FPRD, 1, NS_PER_S, at);
	dc_track_command(&track, at, &payload);
	dc_track_answer(&track, ECAT_CMD_FRMW, 3, NS_PER_S + GRAIN_NS, at);
	for (unsigned i = 0; i < JITTER_CYCLES; i++) {
		int64_t dc_ns;
		uint8_t cmd;

		at = mono_add(at, (span_t){ NS_PER_MS });
		cmd = dc_track_command(&track, at, &payload);
		dc_ns = NS_PER_S + at.ns + (int64_t)(noise(&prng) * (double)sigma_ns);
		dc_ns -= dc_ns % GRAIN_NS;
		coincidences += cmd == ECAT_CMD_FRMW && dc_ns == payload;
		following += cmd == ECAT_CMD_FRMW;
		CHECK_EQ(dc_track_answer(&track, cmd, cmd == ECAT_CMD_FRMW ? 2 : 1, dc_ns, at),
			 dc_ns);
	}
	CHECK(coincidences > JITTER_CYCLES / 1000);
	CHECK_EQ(following, JITTER_CYCLES - coincidences);
}

TEST(exchange, an_answer_that_equals_the_prediction_is_an_answer)
{
	check_jitter(100);
	check_jitter(300);
	check_jitter(900);
}
