/* SPDX-License-Identifier: MIT */
#include "bench.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum {
	ONE = BENCH_STATION,
	MS = 1000000,
	OUTPUTS = 0x1100,
	LEN = 2,
	WATCHED = 0x64,
	UNWATCHED = 0x24,
	PASS_NS = 5, /* from the master to the processing unit of the first slave */
};

static void write_outputs(struct bench *b)
{
	uint8_t data[LEN] = { 0 };

	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, ONE, OUTPUTS, data, LEN), 1);
}

static int is_alive(struct bench *b)
{
	return bench_read8(b, ONE, ESC_REG_WATCHDOG_STATUS_PD) & 1;
}

static struct bench *watched(void)
{
	struct bench *b = bench_create_one();

	bench_sm(b, ONE, 2, OUTPUTS, LEN, WATCHED);
	return b;
}

TEST(watchdog, is_down_until_the_first_outputs_come)
{
	struct bench *b = watched();

	CHECK_EQ(is_alive(b), 0);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PD), 0);
	write_outputs(b);
	CHECK_EQ(is_alive(b), 1);
	bench_destroy(b);
}

TEST(watchdog, expires_after_divider_times_time_to_the_nanosecond)
{
	/* (divider + 2) * 40 ns * time: 100 ms from power-on; and one of our own. */
	static const uint16_t divider[] = { 0x09c2, 498 };
	static const uint16_t time[] = { 1000, 37 };
	static const int64_t wanted_ns[] = { 100 * MS, 37 * 20000 };

	for (unsigned i = 0; i < 2; i++) {
		struct bench *b = watched();
		struct esc *esc = segment_esc(b->segment, 0);
		int64_t fed_ns;

		bench_write16(b, ONE, ESC_REG_WATCHDOG_DIVIDER, divider[i]);
		bench_write16(b, ONE, ESC_REG_WATCHDOG_TIME_PD, time[i]);
		write_outputs(b);
		fed_ns = b->now_ns + PASS_NS;
		segment_advance(b->segment, fed_ns + wanted_ns[i] - 1);
		CHECK_EQ(esc->reg[ESC_REG_WATCHDOG_COUNTER_PD], 0);
		segment_advance(b->segment, fed_ns + wanted_ns[i]);
		CHECK_EQ(esc->reg[ESC_REG_WATCHDOG_COUNTER_PD], 1);
		CHECK_EQ(esc->reg[ESC_REG_WATCHDOG_STATUS_PD] & 1, 0);
		CHECK(esc->al_event & ESC_AL_EVENT_WATCHDOG);
		bench_destroy(b);
	}
}

TEST(watchdog, every_whole_write_feeds_it_and_half_a_write_does_not)
{
	struct bench *b = watched();
	uint8_t half[1] = { 0 };

	for (int i = 0; i < 20; i++) {
		write_outputs(b);
		bench_wait(b, 99 * MS);
	}
	CHECK_EQ(is_alive(b), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, ONE, OUTPUTS, half, 1), 1);
	bench_wait(b, 2 * MS);
	CHECK_EQ(is_alive(b), 0);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PD), 1);
	write_outputs(b);
	CHECK_EQ(is_alive(b), 1);
	bench_destroy(b);
}

TEST(watchdog, outputs_without_the_trigger_bit_do_not_start_it)
{
	struct bench *b = bench_create_one();

	bench_sm(b, ONE, 2, OUTPUTS, LEN, UNWATCHED);
	write_outputs(b);
	CHECK_EQ(is_alive(b), 0);
	bench_wait(b, 500 * MS);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PD), 0);
	bench_destroy(b);
}

TEST(watchdog, time_0_switches_it_off_and_reads_as_alive)
{
	struct bench *b = watched();

	bench_write16(b, ONE, ESC_REG_WATCHDOG_TIME_PD, 0);
	CHECK_EQ(is_alive(b), 1);
	write_outputs(b);
	bench_wait(b, 1000 * MS);
	CHECK_EQ(is_alive(b), 1);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PD), 0);
	bench_destroy(b);
}

TEST(watchdog, switching_its_sync_manager_off_stops_it)
{
	struct bench *b = watched();

	write_outputs(b);
	bench_write8(b, ONE, ESC_REG_SM + 2 * ESC_SM_BYTES + 6, 0);
	bench_wait(b, 500 * MS);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PD), 0);
	bench_destroy(b);
}

TEST(watchdog, its_counter_is_cleared_by_any_write)
{
	struct bench *b = watched();

	for (int i = 0; i < 3; i++) {
		write_outputs(b);
		bench_wait(b, 150 * MS);
	}
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PD), 3);
	bench_write8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PDI, 99);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PD), 0);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PDI), 0);
	bench_destroy(b);
}

TEST(watchdog, an_application_that_falls_silent_shows_in_dl_status)
{
	struct bench *b = bench_create_one();
	uint8_t ignored;

	bench_wait(b, 50 * MS);
	CHECK(bench_read16(b, ONE, ESC_REG_DL_STATUS) & 0x02);
	bench_wait(b, 100 * MS);
	CHECK_EQ(bench_read16(b, ONE, ESC_REG_DL_STATUS) & 0x02, 0);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PDI), 1);
	bench_wait(b, 500 * MS);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_WATCHDOG_COUNTER_PDI), 1);
	bench_pdi_read(b, 0, ESC_REG_AL_STATUS, &ignored, 1);
	CHECK(bench_read16(b, ONE, ESC_REG_DL_STATUS) & 0x02);
	bench_destroy(b);
}
