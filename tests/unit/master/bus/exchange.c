/* SPDX-License-Identifier: MIT */
#include "bus/exchange.h"

#include "unit/master/bus/exchange_bench.h"

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

TEST(exchange, datagrams_are_listed_with_the_working_counters_that_came_back)
{
	struct exchange_plan plan = small_plan();
	struct bench *b;
	struct exchange_datagram list[8];

	plan.monitor = 1;
	b = bench_create(&plan);
	CHECK_EQ(exchange_list(&plan, NULL, list, 8), 4);
	CHECK_EQ(list[0].wkc_expected, 3);
	CHECK_EQ(list[0].wkc, EXCHANGE_WKC_UNKNOWN);
	CHECK_EQ(exchange_list(&plan, b->ex, list, 8), 4);
	CHECK_EQ(list[0].wkc, EXCHANGE_WKC_UNKNOWN);
	run(b);
	b->lrw_wkc = 1;
	CHECK_EQ(run(b).status, EXCHANGE_WKC_LOW);
	CHECK_EQ(exchange_list(&plan, b->ex, list, 8), 4);
	CHECK_EQ(list[0].command, ECAT_CMD_LRW);
	CHECK_EQ(list[0].address, plan.logical_start);
	CHECK_EQ(list[0].bytes, 28);
	CHECK_EQ(list[0].wkc, 1);
	CHECK_EQ(list[1].command, ECAT_CMD_FRMW);
	CHECK_EQ(list[1].address, UINT32_C(0x0910) << 16 | DC_REF);
	CHECK_EQ(list[1].wkc_expected, EXCHANGE_WKC_UNKNOWN);
	CHECK_EQ(list[1].wkc, b->dc_wkc);
	CHECK_EQ(list[2].command, ECAT_CMD_BRD);
	CHECK_EQ(list[2].wkc_expected, 1);
	CHECK_EQ(list[2].wkc, 2);
	CHECK_EQ(list[3].address >> 16, 0x092c);
	CHECK_EQ(exchange_list(&plan, b->ex, list, 3), -E2BIG);
	b->wire.drop = 1;
	b->lrw_wkc = 3;
	CHECK_EQ(run(b).status, EXCHANGE_NO_FRAME);
	CHECK_EQ(exchange_list(&plan, b->ex, list, 8), 4);
	CHECK_EQ(list[0].wkc, 1);
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
static void check_dropped(size_t at, uint8_t flip, int shorten_by)
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
	check_dropped(0, 0, 0);
	check_dropped(6, 0x02, 0);  /* never passed a slave */
	check_dropped(12, 0x01, 0); /* not EtherCAT */
	check_dropped(14, 0x01, 0); /* length of the frame */
	check_dropped(16, 0x01, 0); /* command */
	check_dropped(18, 0x01, 0); /* logical address */
	check_dropped(22, 0x01, 0); /* length of the datagram */
	check_dropped(23, 0x80, 0); /* no more datagrams */
	check_dropped(57, 0x80, 0); /* sequence out of this world */
	check_dropped(58, 0x01, 0); /* another reference clock */
	check_dropped(0, 0, 1);     /* cut */
	check_dropped(0, 0, 62);
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

TEST(exchange, send_error_is_returned_without_waiting)
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
		.chunk_frame = { 0, 1, 2 },
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

/* --- service frames --- */

static void cycle_once(void *ctx, mono_t until)
{
	struct bench *b = ctx;

	(void)until;
	CHECK_EQ(run(b).status, EXCHANGE_OK);
	exchange_ride(b->ex, &(struct exchange_window){
				     .period = { NS_PER_MS },
				     .wire_needed = { b->wire.now_ns + 500000 },
				     .listen_until = { b->wire.now_ns + 300000 },
			     });
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
	CHECK_EQ(line_transact(b->line, frame, len, answer, sizeof(answer), (span_t){ 1000000 }),
		 len);
	CHECK_EQ(answer[17], 200);
	CHECK_EQ(run(b).foreign, 0);
	bench_destroy(b);
}

enum { SERVICE_BYTES = 1400, SERVICE_FRAME_BYTES = SERVICE_BYTES + 28 };

static void submit_service_frame(struct bench *b)
{
	static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };
	struct ecat_frame_builder fb;
	uint8_t frame[LIMIT_FRAME_BYTES];

	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, ECAT_CMD_FPRD, 7, 0x1001, 0x1000, SERVICE_BYTES);
	CHECK_EQ(line_submit(b->line, LINE_MAILBOX, frame, ecat_frame_end(&fb)), 0);
}

/* How many service frames a cycle sends that has @left_ns until its wire is needed. */
static unsigned ride(struct bench *b, int64_t left_ns)
{
	return exchange_ride(b->ex, &(struct exchange_window){
					    .period = { NS_PER_MS },
					    .wire_needed = { b->wire.now_ns + left_ns },
					    .listen_until = { b->wire.now_ns },
				    });
}

TEST(exchange, a_service_frame_that_does_not_fit_any_more_is_kept)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	int64_t frame_ns = ecat_wire_time_ns(SERVICE_FRAME_BYTES);
	int64_t own_ns;

	b->wire.travel_ns = 50000;
	line_ride_begin(b->line, (struct line_waiter){ cycle_once, b });
	run(b);
	own_ns = ecat_wire_time_ns(b->wire.last_sent.len);
	submit_service_frame(b);
	CHECK_EQ(ride(b, -100000), 0);
	CHECK_EQ(ride(b, frame_ns + 50000 - own_ns - 1), 0);
	CHECK_EQ(ride(b, frame_ns + 50000 - own_ns), 1);
	bench_destroy(b);
}

TEST(exchange, the_path_is_the_shortest_of_a_window_and_not_a_stall_of_the_host)
{
	struct exchange_plan plan = small_plan();
	struct bench *b = bench_create(&plan);
	int64_t frame_ns = ecat_wire_time_ns(SERVICE_FRAME_BYTES);

	line_ride_begin(b->line, (struct line_waiter){ cycle_once, b });
	for (unsigned i = 0; i < 1000; i++) {
		b->wire.travel_ns = i % 10 == 3 ? 30000 : 300000;
		run(b);
	}
	submit_service_frame(b);
	CHECK_EQ(ride(b, frame_ns + 30000), 1);
	line_ride_end(b->line);
	line_ride_begin(b->line, (struct line_waiter){ cycle_once, b });
	for (unsigned i = 0; i < 150; i++) { /* slaves have come */
		b->wire.travel_ns = 60000;
		run(b);
	}
	while (line_collect(b->line, LINE_MAILBOX, b->image, sizeof(b->image)) == -EAGAIN) {
	}
	submit_service_frame(b);
	CHECK_EQ(ride(b, frame_ns + 30000), 0);
	CHECK_EQ(ride(b, frame_ns + 60000), 1);
	bench_destroy(b);
}
