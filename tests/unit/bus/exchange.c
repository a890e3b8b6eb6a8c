/* SPDX-License-Identifier: MIT */
#include "bus/exchange.h"

#include "harness/test.h"
#include "unit/link/fake_wire.h"
#include "wire/al.h"

enum { DC_REF = 0x1001, DEADLINE_NS = 400000, PERIOD_NS = 1000000 };

struct bench {
	struct fake_wire wire;
	struct line *line;
	struct exchange *ex;
	uint8_t image[LIMIT_IMAGE_BYTES];
	int64_t dc_offset_ns;
	uint16_t lrw_wkc;
	uint16_t dc_wkc;
	uint8_t input; /* what the slaves write to every input byte */
	uint32_t output_bytes;
};

/* Datagrams by command; inputs get bench->input, FRMW the time of the wire plus an offset. */
static void play_slaves(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	struct bench *b = wire->user;
	struct ecat_datagram dg;
	size_t pos = 0;

	frame[6] |= 0x02;
	while (ecat_frame_next(frame, len, &pos, &dg) == 1) {
		if (dg.cmd == ECAT_CMD_LRW) {
			uint32_t from = ecat_logical_address(&dg) & 0xffff;

			for (uint32_t i = 0; i < dg.data_len; i++) {
				if (from + i >= b->output_bytes) {
					dg.data[i] = b->input;
				} else {
					dg.data[i] ^= 0xff; /* must not come back into the image */
				}
			}
			put_le16(dg.wkc, b->lrw_wkc);
		} else if (dg.cmd == ECAT_CMD_FRMW || dg.cmd == ECAT_CMD_FPRD) {
			uint16_t wkc = dg.cmd == ECAT_CMD_FPRD && b->dc_wkc > 1 ? 1 : b->dc_wkc;

			if (wkc > 0) {
				put_le64(dg.data, (uint64_t)(wire->now_ns + b->dc_offset_ns));
			}
			put_le16(dg.wkc, wkc);
		} else if (dg.cmd == ECAT_CMD_BRD) {
			put_le16(dg.data, dg.ado == 0x0130 ? AL_OP : 253);
			dg.data[3] |= dg.ado == 0x092c ? 0x80 : 0;
			put_le16(frame + (dg.data - frame) - 8, 2);
			put_le16(dg.wkc, 2);
		}
	}
}

static struct exchange_plan small_plan(void)
{
	return (struct exchange_plan){
		.image_bytes = 28,
		.output_bytes = 12,
		.chunk_bytes = { 28 },
		.chunk_count = 1,
		.chunk_wkc = { 3 },
		.wkc_expected = 3,
		.dc_reference = DC_REF,
		.slave_count = 1,
	};
}

static struct bench *bench_create(const struct exchange_plan *plan)
{
	struct bench *b = calloc(1, sizeof(*b));

	b->wire.answer = play_slaves;
	b->wire.user = b;
	b->lrw_wkc = 3;
	b->dc_wkc = 1;
	b->input = 0x5a;
	b->dc_offset_ns = INT64_C(800000000000000000);
	b->output_bytes = plan->output_bytes;
	CHECK_EQ(line_create(fake_platform(&b->wire), fake_transport(&b->wire), &b->line), 0);
	CHECK_EQ(exchange_create(plan, b->line, &b->ex), 0);
	return b;
}

static void bench_destroy(struct bench *b)
{
	exchange_destroy(b->ex);
	line_destroy(b->line);
	free(b);
}

static struct exchange_result run(struct bench *b)
{
	b->wire.now_ns = (b->wire.now_ns / PERIOD_NS + 1) * PERIOD_NS;
	return exchange_run(b->ex, b->image, (mono_t){ b->wire.now_ns + DEADLINE_NS });
}

TEST(exchange, frame_of_28_bytes_with_dc_is_76_bytes_long)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	const uint8_t *f = b->wire.last_sent.bytes;

	run(b);
	run(b);
	CHECK_EQ(b->wire.last_sent.len, 76);
	CHECK_EQ(f[16], ECAT_CMD_LRW);
	CHECK_EQ(get_le16(f + 22), 28 | 0x8000);
	CHECK_EQ(f[56], ECAT_CMD_FRMW);
	CHECK_EQ(get_le16(f + 58), DC_REF);
	CHECK_EQ(get_le16(f + 60), 0x0910);
	CHECK_EQ(get_le16(f + 62), 8);
	bench_destroy(b);
}

TEST(exchange, good_cycle_brings_inputs_time_and_round_trip_and_leaves_outputs)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	struct exchange_result res;

	b->image[0] = 0x11;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_OK);
	CHECK_EQ(res.wkc, 3);
	CHECK_EQ(res.dc_time_ns, b->dc_offset_ns + PERIOD_NS);
	CHECK_EQ(res.round_trip.ns, FAKE_TRAVEL_NS);
	CHECK_EQ(b->wire.last_sent.bytes[26], 0x11);
	CHECK_EQ(b->image[0], 0x11);
	CHECK_EQ(b->image[11], 0);
	CHECK_EQ(b->image[12], 0x5a);
	CHECK_EQ(b->image[27], 0x5a);
	CHECK_EQ(b->image[28], 0);
	CHECK_EQ(res.dc_diff_ns, -1);
	CHECK_EQ(res.late + res.doubled + res.foreign, 0);
	bench_destroy(b);
}

TEST(exchange, lost_frame_costs_the_deadline_and_leaves_the_image)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	struct exchange_result res;

	b->wire.drop = 1;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_NO_FRAME);
	CHECK_EQ(res.round_trip.ns, -1);
	CHECK_EQ(res.dc_time_ns, 0);
	CHECK_EQ(b->wire.now_ns, PERIOD_NS + DEADLINE_NS);
	CHECK_EQ(b->image[12], 0);
	CHECK_EQ(run(b).status, EXCHANGE_OK);
	bench_destroy(b);
}

TEST(exchange, frame_that_comes_a_cycle_late_is_counted_and_never_taken)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	struct exchange_result res;

	b->wire.travel_ns = PERIOD_NS / 2;
	b->input = 0x66;
	CHECK_EQ(run(b).status, EXCHANGE_NO_FRAME);
	b->wire.travel_ns = FAKE_TRAVEL_NS;
	b->input = 0x77;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_OK);
	CHECK_EQ(res.late, 1);
	CHECK_EQ(res.late_by, 1);
	CHECK_EQ(b->image[12], 0x77);
	CHECK_EQ(run(b).late, 0);
	bench_destroy(b);
}

TEST(exchange, every_frame_a_cycle_late_is_never_current_data)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);

	b->wire.travel_ns = PERIOD_NS / 2;
	run(b);
	for (int i = 0; i < 50; i++) {
		struct exchange_result res = run(b);

		CHECK_EQ(res.status, EXCHANGE_NO_FRAME);
		CHECK_EQ(res.late, 1);
		CHECK_EQ(b->image[12], 0);
	}
	bench_destroy(b);
}

TEST(exchange, late_frame_with_the_same_index_byte_is_refused)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	uint8_t old[LIMIT_FRAME_BYTES];
	size_t old_len;
	struct exchange_result res;

	b->wire.drop = 1;
	run(b);
	old_len = b->wire.last_sent.len;
	memcpy(old, b->wire.last_sent.bytes, old_len);
	play_slaves(&b->wire, old, old_len);
	for (int i = 0; i < 255; i++) {
		run(b);
	}
	b->wire.drop = 1;
	fake_queue(&b->wire, old, old_len, b->wire.now_ns);
	b->image[12] = 0;
	res = run(b);
	CHECK_EQ(b->wire.last_sent.bytes[17], old[17]);
	CHECK_EQ(res.status, EXCHANGE_NO_FRAME);
	CHECK_EQ(res.late, 1);
	CHECK_EQ(res.late_by, 256);
	CHECK_EQ(b->image[12], 0);
	bench_destroy(b);
}

TEST(exchange, doubled_frame_is_counted_once_and_never_taken)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	uint8_t copy[LIMIT_FRAME_BYTES];
	size_t len;
	struct exchange_result res;

	b->input = 0x66;
	run(b);
	len = b->wire.last_sent.len;
	memcpy(copy, b->wire.last_sent.bytes, len);
	play_slaves(&b->wire, copy, len);
	fake_queue(&b->wire, copy, len, b->wire.now_ns);
	b->input = 0x77;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_OK);
	CHECK_EQ(res.doubled, 1);
	CHECK_EQ(res.late, 0);
	CHECK_EQ(b->image[12], 0x77);
	CHECK_EQ(run(b).doubled, 0);
	bench_destroy(b);
}

/* One change to an otherwise good answer. */
static void check_thrown_away(size_t at, uint8_t flip, int shorten_by)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	uint8_t bad[LIMIT_FRAME_BYTES];
	size_t len;
	struct exchange_result res;

	run(b);
	memset(b->image, 0, sizeof(b->image));
	b->wire.drop = 1;
	/* The next frame but for its number, which exchange counts up by one. */
	memcpy(bad, b->wire.last_sent.bytes, b->wire.last_sent.len);
	len = b->wire.last_sent.len;
	bad[17]++;
	bad[56] = ECAT_CMD_FRMW;
	play_slaves(&b->wire, bad, len);
	bad[at] ^= flip;
	fake_queue(&b->wire, bad, len - (size_t)shorten_by, b->wire.now_ns);
	res = run(b);
	CHECK_EQ(res.status, flip == 0 && shorten_by == 0 ? EXCHANGE_OK : EXCHANGE_NO_FRAME);
	CHECK_EQ(res.foreign, flip == 0 && shorten_by == 0 ? 0 : 1);
	CHECK_EQ(b->image[12], flip == 0 && shorten_by == 0 ? 0x5a : 0);
	bench_destroy(b);
}

TEST(exchange, damaged_frames_are_foreign_and_an_undamaged_one_is_not)
{
	check_thrown_away(0, 0, 0);
	check_thrown_away(6, 0x02, 0);   /* never passed a slave */
	check_thrown_away(12, 0x01, 0);  /* not EtherCAT */
	check_thrown_away(14, 0x01, 0);  /* length of the frame */
	check_thrown_away(16, 0x01, 0);  /* command */
	check_thrown_away(18, 0x01, 0);  /* logical address */
	check_thrown_away(22, 0x01, 0);  /* length of the datagram */
	check_thrown_away(23, 0x80, 0);  /* no more datagrams */
	check_thrown_away(57, 0x80, 0);  /* sequence out of this world */
	check_thrown_away(58, 0x01, 0);  /* another reference clock */
	check_thrown_away(0, 0, 1);      /* cut */
	check_thrown_away(0, 0, 62);
}

TEST(exchange, low_or_high_wkc_leaves_the_image)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	struct exchange_result res;

	b->lrw_wkc = 1;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_WKC_LOW);
	CHECK_EQ(res.wkc, 1);
	CHECK_EQ(res.wkc_expected, 3);
	CHECK_EQ(b->image[12], 0);
	CHECK(res.round_trip.ns > 0);
	CHECK(res.dc_time_ns > 0);
	b->lrw_wkc = 4;
	CHECK_EQ(run(b).status, EXCHANGE_WKC_LOW);
	CHECK_EQ(b->image[12], 0);
	bench_destroy(b);
}

TEST(exchange, send_error_is_told_and_does_not_wait)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	struct exchange_result res;

	b->wire.send_error = -ENETDOWN;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_NO_FRAME);
	CHECK_EQ(res.send_error, -ENETDOWN);
	CHECK_EQ(b->wire.now_ns, PERIOD_NS);
	bench_destroy(b);
}

TEST(exchange, monitor_reads_states_and_clock_difference)
{
	struct exchange_plan plan = small_plan();
	struct bench *b;
	struct exchange_result res;

	plan.monitor = 1;
	b = bench_create(&plan);
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_OK);
	CHECK_EQ(res.al_wkc, 2);
	CHECK_EQ(res.al_status, AL_OP);
	CHECK_EQ(res.dc_diff_ns, 253);
	CHECK_EQ(b->wire.last_sent.len, 76 + 14 + 16);
	bench_destroy(b);
}

TEST(exchange, image_of_several_frames_is_taken_only_whole)
{
	struct exchange_plan plan = {
		.image_bytes = 3000,
		.output_bytes = 1450,
		.chunk_bytes = { 1400, 1400, 200 },
		.chunk_count = 3,
		.chunk_wkc = { 3, 3, 3 },
		.wkc_expected = 9,
		.dc_reference = DC_REF,
		.slave_count = 3,
	};
	struct bench *b = bench_create(&plan);
	struct exchange_result res = run(b);

	CHECK_EQ(res.status, EXCHANGE_OK);
	CHECK_EQ(res.wkc, 9);
	CHECK_EQ(b->wire.sent, 3);
	CHECK_EQ(b->image[1449], 0);
	CHECK_EQ(b->image[1450], 0x5a);
	CHECK_EQ(b->image[2999], 0x5a);
	b->input = 0x77;
	b->wire.drop = 1;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_NO_FRAME);
	CHECK_EQ(res.wkc, 6);
	CHECK_EQ(b->image[2999], 0x5a);
	bench_destroy(b);
}

TEST(exchange, chunk_that_fits_no_frame_is_refused)
{
	struct exchange_plan plan = small_plan();
	struct bench b = { 0 };

	plan.image_bytes = 1500;
	plan.chunk_bytes[0] = 1500;
	CHECK_EQ(line_create(fake_platform(&b.wire), fake_transport(&b.wire), &b.line), 0);
	CHECK_EQ(exchange_create(&plan, b.line, &b.ex), -E2BIG);
	CHECK(b.ex == NULL);
	plan.chunk_bytes[0] = 1400;
	CHECK_EQ(exchange_create(&plan, b.line, &b.ex), -EINVAL);
	line_destroy(b.line);
}

TEST(exchange, bus_without_process_data_and_clocks_still_has_a_frame)
{
	struct exchange_plan plan = { .slave_count = 1 };
	struct bench *b = bench_create(&plan);

	CHECK_EQ(run(b).status, EXCHANGE_OK);
	CHECK_EQ(b->wire.last_sent.len, 60);
	b->wire.drop = 1;
	CHECK_EQ(run(b).status, EXCHANGE_NO_FRAME);
	bench_destroy(b);
}

/* --- the reference clock --- */

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

TEST(exchange, frmw_stops_when_the_reference_is_gone_and_resumes_with_it)
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

/* Slaves behind the reference still count when it is gone: the payload comes back as it went. */
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

TEST(exchange, payload_that_nobody_overwrote_is_no_time)
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

/* --- service frames --- */

static void cycle_once(void *ctx, mono_t until)
{
	struct bench *b = ctx;

	(void)until;
	CHECK_EQ(run(b).status, EXCHANGE_OK);
	exchange_ride(b->ex, (mono_t){ b->wire.now_ns + 300000 });
}

TEST(exchange, service_frame_rides_along_and_is_not_foreign)
{
	static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	struct ecat_frame_builder fb;
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len;

	line_ride_begin(b->line, (struct line_waiter){ cycle_once, b });
	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, ECAT_CMD_BRD, 200, 0, 0x0130, 2);
	len = ecat_frame_end(&fb);
	CHECK_EQ(line_transact(b->line, frame, len, answer, sizeof(answer), (span_t){ 1000000 }), len);
	CHECK_EQ(answer[17], 200);
	CHECK_EQ(run(b).foreign, 0);
	bench_destroy(b);
}
