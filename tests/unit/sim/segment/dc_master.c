/* SPDX-License-Identifier: MIT */
#include "dc_master.h"

#include "harness/test.h"
#include "wire/esc_reg.h"

enum { SPEED_START = 0x1000, TIME_FILTER = 0, SPEED_FILTER = 12, MAGNITUDE = 0x7fffffff };

static uint16_t station(unsigned i)
{
	return (uint16_t)(BENCH_STATION + i);
}

uint32_t dc_master_round_trip_ns(struct bench *b, unsigned i)
{
	return bench_read32(b, station(i), ESC_REG_DC_RECEIVE_TIME_PORT + 4) -
	       bench_read32(b, station(i), ESC_REG_DC_RECEIVE_TIME_PORT);
}

void dc_master_align(struct bench *b, unsigned count, uint64_t now_ns)
{
	uint8_t zeros[4] = { 0 };
	uint32_t whole_ns;

	for (unsigned i = 0; i < count; i++) {
		bench_write16(b, station(i), ESC_REG_DC_TIME_FILTER,
			      TIME_FILTER | SPEED_FILTER << 8);
	}
	CHECK_EQ(bench_send(b, ECAT_CMD_BWR, 0, ESC_REG_DC_RECEIVE_TIME_PORT, zeros, 4), count);
	whole_ns = count > 1 ? dc_master_round_trip_ns(b, 0) : 0;
	for (unsigned i = 0; i < count; i++) {
		uint32_t behind_ns = i + 1 < count ? dc_master_round_trip_ns(b, i) : 0;
		uint32_t delay_ns = (whole_ns - behind_ns) / 2;
		uint64_t latched_ns = bench_read64(b, station(i), ESC_REG_DC_RECEIVE_TIME_PU);

		bench_write32(b, station(i), ESC_REG_DC_SYSTEM_TIME_DELAY, delay_ns);
		bench_write64(b, station(i), ESC_REG_DC_SYSTEM_TIME_OFFSET, now_ns - latched_ns);
		bench_write16(b, station(i), ESC_REG_DC_SPEED_COUNTER_START, SPEED_START);
	}
}

void dc_master_distribute(struct bench *b, unsigned count, int64_t period_ns)
{
	for (unsigned i = 0; i < count; i++) {
		uint8_t time[8] = { 0 };

		bench_wait(b, period_ns - BENCH_STEP_NS > 0 ? period_ns - BENCH_STEP_NS : 0);
		b->now_ns -= period_ns < BENCH_STEP_NS ? BENCH_STEP_NS - period_ns : 0;
		(void)bench_send(b, ECAT_CMD_FRMW, station(0), ESC_REG_DC_SYSTEM_TIME, time, 8);
	}
}

uint32_t dc_master_worst_difference(struct bench *b, unsigned count)
{
	uint32_t worst = 0;

	for (unsigned i = 1; i < count; i++) {
		uint32_t d = bench_read32(b, station(i), ESC_REG_DC_SYSTEM_TIME_DIFF) & MAGNITUDE;

		worst = d > worst ? d : worst;
	}
	return worst;
}

int64_t dc_master_skew_ns(const struct bench *b, unsigned count)
{
	int64_t low = INT64_MAX;
	int64_t high = INT64_MIN;

	for (unsigned i = 0; i < count; i++) {
		int64_t t = (int64_t)esc_system_time(segment_esc(b->segment, i), b->now_ns);

		low = t < low ? t : low;
		high = t > high ? t : high;
	}
	return high - low;
}

void dc_master_sync0(struct bench *b, unsigned i, uint64_t start_ns, uint32_t cycle_ns)
{
	bench_write8(b, station(i), ESC_REG_DC_ACTIVATION, 0);
	bench_write64(b, station(i), ESC_REG_DC_START_TIME, start_ns);
	bench_write32(b, station(i), ESC_REG_DC_SYNC0_CYCLE, cycle_ns);
	bench_write8(b, station(i), ESC_REG_DC_ACTIVATION, 3);
}
