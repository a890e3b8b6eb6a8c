/* SPDX-License-Identifier: MIT */
/* What goes wrong on the wire while the bus comes up or runs. */
#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/bus/bus_bench.h"
#include "wire/esc_reg.h"

/* Frames that a clean bring-up takes, up to its clocks. */
static unsigned frames_of(uint64_t seed)
{
	static const char *const settings[] = { "dc.burst_frames=100", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 2, .seed = seed, .settings = settings });
	unsigned frames;

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bus_map(b->bus, b->error), 0);
	frames = bench_frames_sent(b);
	bench_destroy(b);
	return frames;
}

/*
 * T42: a single frame of scan and mapping is lost, one run each: of the first ones each, then every
 * fourth from @phase on, since most of them are alike (EEPROM words). The four actions together
 * meet every frame.
 */
static void check_loss(const char *action, unsigned phase)
{
	enum { EACH = 60, STRIDE = 4 };
	static const char *const settings[] = { "dc.burst_frames=100", NULL };
	unsigned frames = frames_of(30);

	CHECK(frames > 200);
	for (unsigned n = 1; n <= frames; n += n < EACH + phase ? 1 : STRIDE) {
		struct bus_bench *b = bench_create(
			&(struct bench_spec){ .piccolos = 2, .seed = 30, .settings = settings });
		size_t count;
		char line[64];
		int r;

		snprintf(line, sizeof(line), "frame=%u %s", n, action);
		bench_fault(b, line);
		r = bench_find(b);
		if (r == 0) {
			r = bus_map(b->bus, b->error);
		}
		if (r < 0) {
			test_fail(__FILE__, __LINE__, "frame %u of %u, %s: %d: %s", n, frames,
				  action, r, b->error);
		}
		bus_channels(b->bus, &count);
		CHECK_EQ(count, 12);
		CHECK_EQ(bus_plan(b->bus)->wkc_expected, 6);
		CHECK_EQ(bus_plan(b->bus)->image_bytes, 44);
		bench_destroy(b);
	}
}

TEST(faults, any_single_frame_of_scan_and_mapping_may_be_lost_on_the_way_back)
{
	check_loss("lose", 0);
}

TEST(faults, any_single_frame_of_scan_and_mapping_may_be_lost_on_the_way_out)
{
	check_loss("drop", 1);
}

TEST(faults, any_single_frame_of_scan_and_mapping_may_come_twice)
{
	check_loss("double", 2);
}

TEST(faults, any_single_frame_of_scan_and_mapping_may_be_late)
{
	check_loss("delay by=15ms", 3);
}

TEST(faults, one_frame_in_a_hundred_lost_does_not_keep_the_bus_from_op)
{
	for (uint64_t seed = 40; seed < 50; seed++) {
		struct bus_bench *b =
			bench_create(&(struct bench_spec){ .piccolos = 2, .seed = seed });

		bench_fault(b, "p=0.01 lose");
		bench_bring_up(b);
		bench_run(b, 500);
		CHECK(b->lost > 0);
		CHECK(b->ok > b->cycles * 9 / 10);
		bench_destroy(b);
	}
}

/* T09: the master is killed in OP; SYNC0 continues, the slaves are in OP or left it by watchdog. */
TEST(faults, after_a_killed_master_the_next_one_reaches_op)
{
	for (unsigned wait_ms = 0; wait_ms <= 300; wait_ms += 60) {
		struct bus_bench *b =
			bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 50 + wait_ms });
		struct platform platform = in_process_platform(b->host);

		bench_bring_up(b);
		bench_run(b, 20);
		bench_new_master(b);
		platform.sleep_until(platform.ctx, mono_add(platform.now(platform.ctx),
							    (span_t){ wait_ms * NS_PER_MS }));
		bench_bring_up(b);
		bench_run(b, 100);
		CHECK_EQ(b->last.status, EXCHANGE_OK);
		CHECK_EQ(b->last.al_status, AL_OP);
		bench_destroy(b);
	}
}

/* T10 */
TEST(faults, sync0_start_in_the_past_is_detected_and_retried)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 60 });
	uint64_t before;

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	CHECK_EQ(bench_cycle(b), 0);
	CHECK_EQ(bus_sync0_start(b->bus, b->last.dc_time_ns - 10 * NS_PER_S, b->error), 0);
	CHECK_EQ(bus_request_state(b->bus, AL_SAFEOP, (span_t){ NS_PER_S }, b->error), 0);
	CHECK_EQ(bus_request_state(b->bus, AL_OP, (span_t){ NS_PER_S }, b->error), 0);
	bench_run(b, 50);
	before = bench_value(b, "piccolo1.counter");
	bench_run(b, 100);
	CHECK_EQ((uint16_t)(bench_value(b, "piccolo1.counter") - before), 100);
	bench_destroy(b);
}

/* T03: the slave has the message; only the answer to the write is late. */
TEST(faults, late_answer_to_a_mailbox_write_writes_once)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 61 });
	uint64_t value = 0;

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	for (unsigned n = 1; n <= 8; n++) {
		uint8_t data[2] = { (uint8_t)(10 + n), 0 };
		size_t len = sizeof(data);
		uint32_t abort;
		unsigned before = bench_mailbox_writes(b);
		char line[64];

		snprintf(line, sizeof(line), "frame=%u delay by=30ms", bench_frames_sent(b) + n);
		bench_fault(b, line);
		CHECK_EQ(bus_sdo_write(b->bus, 0, 0x8000, 2, data, sizeof(data), &abort), 0);
		CHECK_EQ(bench_mailbox_writes(b) - before, 1);
		CHECK_EQ(bus_sdo_read(b->bus, 0, 0x8000, 2, data, &len, &abort), 0);
		CHECK_EQ(get_le16(data), 10 + n);
		value = get_le16(data);
	}
	CHECK_EQ(value, 18);
	bench_destroy(b);
}

/* T02: an SDO storm leaves every cycle whole. */
TEST(faults, sdo_storm_costs_no_cycle)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 62 });
	uint64_t cycles;
	uint64_t ok;

	bench_bring_up(b);
	bench_run(b, 50);
	cycles = b->cycles;
	ok = b->ok;
	for (unsigned i = 0; i < 300; i++) {
		uint8_t data[64];
		size_t len = sizeof(data);
		uint32_t abort;

		CHECK_EQ(bus_sdo_read(b->bus, (uint16_t)(i % 2), 0x1008, 0, data, &len, &abort), 0);
	}
	CHECK(b->cycles - cycles > 300);
	CHECK_EQ(b->ok - ok, b->cycles - cycles);
	CHECK_EQ(b->last.foreign, 0);
	bench_destroy(b);
}

/* T07 */
TEST(faults, no_watchdog_trips_on_the_way_to_op)
{
	for (uint64_t seed = 0; seed < 50; seed++) {
		struct bus_bench *b =
			bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 1000 + seed });

		bench_bring_up(b);
		for (unsigned i = 0; i < 2; i++) {
			CHECK_EQ(segment_esc(b->segment, i)->reg[ESC_REG_WATCHDOG_COUNTER_PD], 0);
			CHECK_EQ(get_le16(segment_esc(b->segment, i)->reg + ESC_REG_AL_STATUS_CODE),
				 0);
		}
		bench_destroy(b);
	}
}

TEST(faults, slave_that_refuses_is_named_with_code_and_text)
{
	static const char *const settings[] = { "dc.enable=off", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 2, .seed = 63, .settings = settings });

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	CHECK_EQ(bench_cycle(b), 0);
	CHECK_EQ(bus_request_state(b->bus, AL_SAFEOP, (span_t){ NS_PER_S }, b->error), -ETIME);
	CHECK_STR(b->error,
		  "slave 0 (piccolo0): refuses SAFE-OP and is in PRE-OP: AL status code 0x0030, "
		  "invalid DC SYNC configuration");
	bench_destroy(b);
}

static int clocks_with(const char *fault, char *ret_error)
{
	static const char *const settings[] = { "dc.burst_frames=2000", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 2, .seed = 31, .settings = settings });
	int r;

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bus_map(b->bus, b->error), 0);
	bench_fault(b, fault);
	r = bus_dc_setup(b->bus, b->error);
	memcpy(ret_error, b->error, BUS_ERROR_BYTES);
	bench_destroy(b);
	return r;
}

TEST(faults, drift_burst_continues_after_a_short_silence_of_the_wire)
{
	char error[BUS_ERROR_BYTES];

	/* Longer than all three tries of one frame take together. */
	CHECK_EQ(clocks_with("at=5ms for=200ms lose", error), 0);
}

TEST(faults, drift_burst_on_a_dead_wire_ends_and_reports_the_duration_of_silence)
{
	char error[BUS_ERROR_BYTES];

	CHECK_EQ(clocks_with("at=5ms for=60s lose", error), -EIO);
	CHECK(strstr(error, "no frame has come back for 496 ms during drift compensation") != NULL);
	CHECK(strstr(error, "bus.frame_timeout is 2000 us") != NULL);
}
