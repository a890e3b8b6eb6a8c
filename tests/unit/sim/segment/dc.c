/* SPDX-License-Identifier: MIT */
/* Distributed clocks: latches, regulation, and how well the real edges agree. */
#include "base/bytes.h"
#include "dc_master.h"
#include "devices/catalogue.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum {
	PDI_SPI = 0x05,
	BOTH_DC_UNITS = 0x0c,
	MS = 1000000,
	FIRST = BENCH_STATION,
	SECOND = BENCH_STATION + 1,
	SYNC0_CYCLE = 1000000,
};

#define START_NS UINT64_C(845000000000000000) /* 2026, as masters set it */

static struct bench *line_of(const double *ppm, const uint64_t *clock_ns, unsigned count)
{
	struct bench_slave slaves[BENCH_SLAVES] = { 0 };

	for (unsigned i = 0; i < count; i++) {
		slaves[i] = (struct bench_slave){ .pdi = PDI_SPI,
						  .config = BOTH_DC_UNITS,
						  .ppm = ppm[i],
						  .clock_ns = clock_ns[i] };
	}
	return bench_create(slaves, count);
}

/* --- edges as they really come --- */

static struct {
	int64_t last_ns[BENCH_SLAVES];
	uint64_t count[BENCH_SLAVES];
	int64_t worst_ns; /* between edges that belong together */
	unsigned slaves;
} edges;

static void take_edge(void *ctx, unsigned slave, int64_t t_ns, uint64_t system_time_ns)
{
	(void)ctx;
	(void)system_time_ns;
	edges.last_ns[slave] = t_ns;
	edges.count[slave]++;
	for (unsigned i = 0; i < edges.slaves; i++) {
		int64_t apart = llabs(t_ns - edges.last_ns[i]);

		if (edges.count[i] == edges.count[slave] && apart > edges.worst_ns) {
			edges.worst_ns = apart;
		}
	}
}

static void watch_edges(struct bench *b, unsigned slaves)
{
	memset(&edges, 0, sizeof(edges));
	edges.slaves = slaves;
	segment_sync0_to(b->segment, take_edge, NULL);
}

static const double skewed[] = { -100.0, 100.0, -40.0, 73.5 };
static const uint64_t apart[] = { 0, UINT64_C(4294000000), 77, UINT64_C(987654321012) };

static void check_convergence(unsigned first_frames, int64_t first_period_ns)
{
	struct bench *b = line_of(skewed, apart, 4);
	uint64_t now_ns;

	dc_master_align(b, 4, START_NS);
	dc_master_distribute(b, first_frames, first_period_ns);
	now_ns = bench_read64(b, FIRST, ESC_REG_DC_SYSTEM_TIME);
	for (unsigned i = 0; i < 4; i++) {
		dc_master_sync0(b, i, (now_ns / SYNC0_CYCLE + 50) * SYNC0_CYCLE, SYNC0_CYCLE);
	}
	watch_edges(b, 4);
	dc_master_distribute(b, 2000, MS);
	printf("after %u FRMW every %lld us: 0x092c at most %u ns, clocks within %lld ns, SYNC0 "
	       "within %lld ns "
	       "over %llu edges\n",
	       first_frames, (long long)(first_period_ns / 1000), dc_master_worst_difference(b, 4),
	       (long long)dc_master_skew_ns(b, 4), (long long)edges.worst_ns,
	       (unsigned long long)edges.count[0]);
	CHECK(edges.count[0] > 1900);
	for (unsigned i = 1; i < 4; i++) {
		/* The last edge may lie on either side of the end. */
		CHECK(llabs((long long)(edges.count[i] - edges.count[0])) <= 1);
	}
	CHECK(dc_master_worst_difference(b, 4) < 100);
	CHECK(edges.worst_ns < 100);
	bench_destroy(b);
}

TEST(sim_dc, clocks_at_plus_minus_100_ppm_agree_after_two_seconds_of_frmw_at_1_khz)
{
	check_convergence(2000, MS);
}

TEST(sim_dc, clocks_at_plus_minus_100_ppm_agree_after_a_burst_of_frmw)
{
	check_convergence(15000, 36000);
}

TEST(sim_dc, twelve_frmw_in_one_frame_count_as_one)
{
	struct bench *b = line_of(skewed, apart, 2);
	struct esc *esc = segment_esc(b->segment, 1);
	struct esc_frame at = { .ports_used = 1 };
	struct ecat_frame_builder fb;
	int64_t before;

	dc_master_align(b, 2, START_NS);
	dc_master_distribute(b, 20, MS);
	at.pu_ns = b->now_ns + MS;
	for (int i = 0; i < 12; i++) {
		struct ecat_datagram dg;
		size_t pos = 0;

		ecat_frame_begin(&fb, b->frame, (const uint8_t[6]){ 2 });
		put_le64(ecat_frame_add(&fb, ECAT_CMD_FRMW, 0, FIRST, ESC_REG_DC_SYSTEM_TIME, 8),
			 esc_system_time(segment_esc(b->segment, 0), at.pu_ns));
		b->frame_len = ecat_frame_end(&fb);
		CHECK_EQ(ecat_frame_next(b->frame, b->frame_len, &pos, &dg), 1);
		before = esc->clock.correction;
		esc_datagram(esc, &at, &dg);
		CHECK((before != esc->clock.correction) == (i == 0));
	}
	bench_destroy(b);
}

TEST(sim_dc, a_drift_step_in_the_middle_is_followed)
{
	struct bench *b = line_of(skewed, apart, 2);

	dc_master_align(b, 2, START_NS);
	dc_master_distribute(b, 2000, MS);
	esc_clock_drift(segment_esc(b->segment, 1), b->now_ns, -60.0);
	dc_master_distribute(b, 30, MS);
	CHECK(dc_master_worst_difference(b, 2) > 100);
	dc_master_distribute(b, 2000, MS);
	CHECK(dc_master_worst_difference(b, 2) < 100);
	CHECK(dc_master_skew_ns(b, 2) < 100);
	bench_destroy(b);
}

TEST(sim_dc, bit_31_of_the_difference_says_that_the_copy_is_behind)
{
	static const double same[] = { 0, 0 };
	struct bench *b = line_of(same, apart, 2);
	uint8_t ahead[8];
	uint32_t d;

	bench_write16(b, SECOND, ESC_REG_DC_TIME_FILTER, 12 << 8);
	bench_write16(b, SECOND, ESC_REG_DC_SPEED_COUNTER_START, 0x1000);
	put_le64(ahead,
		 esc_system_time(segment_esc(b->segment, 1), b->now_ns + BENCH_STEP_NS) + 5000);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, SECOND, ESC_REG_DC_SYSTEM_TIME, ahead, 8), 1);
	d = bench_read32(b, SECOND, ESC_REG_DC_SYSTEM_TIME_DIFF);
	CHECK(d >> 31);
	CHECK((d & 0x7fffffff) > 4000 && (d & 0x7fffffff) < 5001);
	bench_write16(b, SECOND, ESC_REG_DC_SPEED_COUNTER_START, 0x1000);
	CHECK_EQ(bench_read32(b, SECOND, ESC_REG_DC_SYSTEM_TIME_DIFF), 0);
	bench_destroy(b);
}

TEST(sim_dc, a_new_filter_depth_counts_from_the_next_write_to_0930)
{
	struct bench *b = bench_create_one();
	struct esc *esc = segment_esc(b->segment, 0);

	CHECK_EQ(esc->clock.time_filter, 4);
	bench_write8(b, FIRST, ESC_REG_DC_TIME_FILTER, 7);
	CHECK_EQ(esc->clock.time_filter, 4);
	bench_write16(b, FIRST, ESC_REG_DC_SPEED_COUNTER_START, 0x0800);
	CHECK_EQ(esc->clock.time_filter, 7);
	CHECK_EQ(esc->clock.speed_start, 0x0800);
	bench_destroy(b);
}

TEST(sim_dc, the_speed_counter_difference_says_how_fast_the_clock_was_made)
{
	static const double ppm[] = { 0, 80.0 };
	struct bench *b = line_of(ppm, apart, 2);
	int16_t d;
	double rate;

	dc_master_align(b, 2, START_NS);
	dc_master_distribute(b, 3000, MS);
	d = (int16_t)bench_read16(b, SECOND, ESC_REG_DC_SPEED_COUNTER_DIFF);
	/* Data sheet, 0x0932: D / (5 (S + D + 2) (S - D + 2)), by which it was too fast. */
	rate = d / (5.0 * (0x1000 + d + 2) * (0x1000 - d + 2));
	CHECK(rate > -80.5e-6 && rate < -79.5e-6);
	bench_destroy(b);
}

/* --- latches --- */

TEST(sim_dc, receive_times_of_a_line_give_its_delays_whatever_the_clocks_show)
{
	/* The second latch of each lies around a wrap of 31 or 32 bits (T13). */
	static const uint64_t clocks[][4] = {
		{ 0, 0, 0, 0 },
		{ 0x7fffffff - 12 * MS, 0xffffffff - 12 * MS, 5, UINT64_C(0x17fffffff) - 12 * MS },
		{ 0xffffffff - 12 * MS, 0x7fffffff - 12 * MS, 0xfffffffe - 12 * MS, 1 },
	};
	static const double same[] = { 0, 0, 0, 0 };

	for (unsigned k = 0; k < 3; k++) {
		struct bench *b = line_of(same, clocks[k], 4);
		uint8_t zeros[4] = { 0 };

		for (int64_t step = 0; step < 24; step++) {
			/* Bench: wires 5 ns, 150 ns in, 140 ns back. The last has nothing behind
			 * it. */
			CHECK_EQ(bench_send(b, ECAT_CMD_BWR, 0, ESC_REG_DC_RECEIVE_TIME_PORT, zeros,
					    4),
				 4);
			CHECK_EQ(dc_master_round_trip_ns(b, 2), 310);
			CHECK_EQ(dc_master_round_trip_ns(b, 1), 310 + 300);
			CHECK_EQ(dc_master_round_trip_ns(b, 0), 310 + 300 + 300);
		}
		bench_destroy(b);
	}
}

TEST(sim_dc, a_slave_without_clock_between_two_with_one_adds_its_delay)
{
	/* T14: EK1100, EL2828, EL2889. */
	struct bench_slave slaves[] = {
		{ .features = catalogue_features(2, 0x044c2c52), .config = 0x0d },
		{ .features = catalogue_features(2, 0x0b0c3052), .pdi = 4, .config = 1 },
		{ .features = catalogue_features(2, 0x0b493052), .pdi = 4, .config = 1 },
	};
	struct bench *b = bench_create(slaves, 3);
	uint8_t zeros[4] = { 0 };
	uint64_t at_first;
	uint64_t at_third;

	CHECK_EQ(bench_send(b, ECAT_CMD_BWR, 0, ESC_REG_DC_RECEIVE_TIME_PORT, zeros, 4), 3);
	at_first = bench_read64(b, FIRST, ESC_REG_DC_RECEIVE_TIME_PU);
	at_third = bench_read64(b, FIRST + 2, ESC_REG_DC_RECEIVE_TIME_PU);
	CHECK_EQ(at_third - at_first, 2 * (150 + 5));
	CHECK_EQ(bench_send(b, ECAT_CMD_FRMW, FIRST, ESC_REG_DC_SYSTEM_TIME, (uint8_t[8]){ 0 }, 8),
		 2);
	bench_destroy(b);
}

TEST(sim_dc, the_master_reads_a_slaves_time_as_of_the_reference_clock)
{
	static const double same[] = { 0, 0 };
	static const uint64_t zero[] = { 0, 0 };
	struct bench *b = line_of(same, zero, 2);
	uint64_t pdi;
	uint64_t ecat;

	bench_write32(b, SECOND, ESC_REG_DC_SYSTEM_TIME_DELAY, 155);
	ecat = bench_read64(b, SECOND, ESC_REG_DC_SYSTEM_TIME);
	CHECK_EQ(ecat, (uint64_t)b->now_ns + 5); /* true time at the first slave */
	bench_pdi_read(b, 1, ESC_REG_DC_SYSTEM_TIME, &pdi, 8);
	CHECK_EQ(pdi, (uint64_t)b->now_ns);
	bench_destroy(b);
}

TEST(sim_dc, a_clock_of_32_bits_has_no_upper_halves)
{
	struct esc_features small = esc_et1100;
	struct bench_slave slave = { .features = &small,
				     .pdi = PDI_SPI,
				     .config = BOTH_DC_UNITS,
				     .clock_ns = UINT64_C(0x5ffffff00) };
	struct bench *b;
	uint8_t data[8] = { 0 };

	small.dc = ESC_DC_32;
	b = bench_create(&slave, 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, FIRST, ESC_REG_DC_SYSTEM_TIME, data, 8), 1);
	CHECK_EQ(get_le32(data + 4), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, FIRST, ESC_REG_DC_SYSTEM_TIME + 4, data, 4), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, FIRST, ESC_REG_DC_SYSTEM_TIME_OFFSET + 4, data, 4),
		 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, FIRST, ESC_REG_DC_NEXT_SYNC1 + 4, data, 4), 0);
	bench_destroy(b);
}

TEST(sim_dc, time_filter_and_difference_are_not_there_without_a_system_time)
{
	struct bench_slave terminal = { .features = catalogue_features(2, 0x03ec3052),
					.pdi = 4,
					.config = 1 };
	struct bench *b = bench_create(&terminal, 1);
	uint8_t data[8] = { 0 };

	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, FIRST, ESC_REG_DC_RECEIVE_TIME_PORT, data, 4), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, FIRST, ESC_REG_DC_RECEIVE_TIME_PU, data, 8), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, FIRST, ESC_REG_DC_SYSTEM_TIME_DIFF, data, 4), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, FIRST, ESC_REG_DC_TIME_FILTER, data, 2), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, FIRST, ESC_REG_DC_ACTIVATION, data, 1), 0);
	bench_destroy(b);
}
