/* SPDX-License-Identifier: MIT */
/* The reference clock in the cyclic frame: followed, lost, back, implausible. */
#include "bus/exchange_dc.h"

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

TEST(exchange, payload_that_no_slave_overwrote_is_no_time)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);

	b->dc_wkc = 3;
	run(b);
	run(b);
	run(b);
	b->wire.answer = answer_without_reference;
	CHECK_EQ(run(b).dc_time_ns, 0);
	run(b);
	CHECK_EQ(dc_command(b), ECAT_CMD_FPRD);
	bench_destroy(b);
}
