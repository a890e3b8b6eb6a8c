/* SPDX-License-Identifier: MIT */
/* Reset, write protection, counters; and that wire and crystals are no ideal ones. */
#include "base/bytes.h"
#include "bench.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum {
	MS = 1000000,
	OUTPUTS = 0x1100,
	PROTECT = ESC_REG_WRITE_PROTECT,
};

static uint16_t write_outputs(struct bench *b)
{
	uint8_t data[2] = { 1, 2 };

	return bench_send(b, ECAT_CMD_FPWR, BENCH_STATION, OUTPUTS, data, 2);
}

TEST(chip, counters_stop_at_255_and_a_write_clears_them)
{
	struct bench *b = bench_create_one();
	struct esc *esc = segment_esc(b->segment, 0);

	for (unsigned i = 0; i < 300; i++) {
		segment_damaged_frame(b->segment, b->now_ns, 0);
	}
	CHECK_EQ(bench_read8(b, BENCH_STATION, ESC_REG_RX_ERROR_COUNTER), 255);
	bench_write8(b, BENCH_STATION, ESC_REG_RX_ERROR_COUNTER + 1, 7);
	CHECK_EQ(bench_read8(b, BENCH_STATION, ESC_REG_RX_ERROR_COUNTER), 0);
	CHECK_EQ(esc->reg[ESC_REG_RX_ERROR_COUNTER + 1], 0);
	bench_destroy(b);
}

TEST(chip, a_frame_damaged_on_the_way_is_counted_from_there_on)
{
	const struct bench_slave slaves[3] = { { .pdi = 5 }, { .pdi = 5 }, { .pdi = 5 } };
	struct bench *b = bench_create(slaves, 3);

	segment_damaged_frame(b->segment, b->now_ns, 1);
	CHECK_EQ(bench_read8(b, 0x1000, ESC_REG_RX_ERROR_COUNTER), 0);
	CHECK_EQ(bench_read8(b, 0x1001, ESC_REG_RX_ERROR_COUNTER), 1);
	CHECK_EQ(bench_read8(b, 0x1002, ESC_REG_RX_ERROR_COUNTER), 0);
	CHECK_EQ(bench_read8(b, 0x1002, ESC_REG_FORWARDED_RX_ERROR), 1);
	bench_destroy(b);
}

TEST(chip, r_e_s_starts_it_anew)
{
	struct bench *b = bench_create_one();
	uint8_t data[1] = { 0 };

	bench_write8(b, BENCH_STATION, ESC_REG_RESET_ECAT, 'R');
	bench_write8(b, BENCH_STATION, ESC_REG_RESET_ECAT, 'E');
	CHECK_EQ(bench_read8(b, BENCH_STATION, ESC_REG_RESET_ECAT), 2);
	bench_write8(b, BENCH_STATION, ESC_REG_RESET_ECAT, 'X');
	CHECK_EQ(bench_read8(b, BENCH_STATION, ESC_REG_RESET_ECAT), 0);
	bench_write8(b, BENCH_STATION, ESC_REG_RESET_ECAT, 'R');
	bench_write8(b, BENCH_STATION, ESC_REG_RESET_ECAT, 'E');
	bench_write8(b, BENCH_STATION, ESC_REG_RESET_ECAT, 'S');
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, BENCH_STATION, ESC_REG_TYPE, data, 1), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_APRD, 0, ESC_REG_TYPE, data, 1), 1);
	CHECK_EQ(esc_eeprom_loaded(segment_esc(b->segment, 0)), 0);
	bench_wait(b, 5 * MS);
	CHECK_EQ(esc_eeprom_loaded(segment_esc(b->segment, 0)), 1);
	bench_destroy(b);
}

TEST(chip, write_protection_is_lifted_for_one_frame)
{
	struct bench *b = bench_create_one();
	struct ecat_frame_builder fb;
	uint8_t alias[2] = { 5, 0 };
	uint8_t *first;
	uint8_t *second;

	bench_write8(b, BENCH_STATION, PROTECT, 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, BENCH_STATION, ESC_REG_WATCHDOG_TIME_PD, alias, 2),
		 0);
	bench_destroy(b);

	/* Process data goes on. */
	b = bench_create_one();
	bench_sm(b, BENCH_STATION, 2, OUTPUTS, 2, 0x24);
	bench_write8(b, BENCH_STATION, PROTECT, 1);
	CHECK_EQ(write_outputs(b), 1);
	ecat_frame_begin(&fb, b->frame, (const uint8_t[6]){ 2 });
	first = ecat_frame_add(&fb, ECAT_CMD_FPWR, 0, BENCH_STATION, ESC_REG_WRITE_ENABLE, 1);
	second = ecat_frame_add(&fb, ECAT_CMD_FPWR, 0, BENCH_STATION, ESC_REG_WATCHDOG_TIME_PD, 2);
	second[0] = 77;
	CHECK_EQ(segment_frame(b->segment, b->now_ns, b->frame, ecat_frame_end(&fb), &b->back_ns),
		 0);
	CHECK_EQ(first[1], 1);
	CHECK_EQ(second[2], 1);
	CHECK_EQ(bench_read16(b, BENCH_STATION, ESC_REG_WATCHDOG_TIME_PD), 77);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, BENCH_STATION, ESC_REG_WATCHDOG_TIME_PD, alias, 2),
		 0);
	bench_destroy(b);
}

TEST(chip, a_wire_carries_one_frame_at_a_time)
{
	struct bench *b = bench_create_one();
	uint8_t big[1000] = { 0 };
	uint8_t byte[1] = { 0 };
	int64_t first_ns;

	bench_send(b, ECAT_CMD_FPRD, BENCH_STATION, 0x1000, big, sizeof(big));
	first_ns = b->back_ns;
	b->now_ns -= BENCH_STEP_NS; /* sent at once behind it */
	bench_send(b, ECAT_CMD_FPRD, BENCH_STATION, ESC_REG_TYPE, byte, 1);
	/* 1000 bytes of data, 28 of headers and WKC, 24 around them, at 80 ns */
	CHECK_EQ(b->back_ns - first_ns, (1000 + 28 + 24) * 80);
	bench_destroy(b);
}

/* --- crystals --- */

static struct segment *one_slave(int64_t jitter_ns, double wander_ppm, uint64_t seed)
{
	static uint8_t sii[BENCH_SII_BYTES] = { [0] = 5, [1] = 0x0c };
	const struct segment_slave_spec spec = { .features = &esc_et1100,
						 .sii = sii,
						 .sii_bytes = sizeof(sii),
						 .ppm = 20,
						 .wander_ppm = wander_ppm,
						 .jitter_ns = jitter_ns,
						 .seed = seed,
						 .parent = -1 };
	struct segment *segment;

	CHECK_EQ(segment_create(&spec, 1, 0, &segment), 0);
	return segment;
}

TEST(chip, a_crystal_wanders_within_its_bounds_and_the_same_for_the_same_seed)
{
	struct segment *steady = one_slave(0, 0, 1);
	struct segment *a = one_slave(0, 5.0, 1);
	struct segment *same = one_slave(0, 5.0, 1);
	struct segment *other = one_slave(0, 5.0, 2);
	int has_wandered = 0;

	for (int64_t s = 1; s <= 600; s++) {
		int64_t t_ns = s * 1000 * MS;
		int64_t off_ns;

		segment_advance(steady, t_ns);
		segment_advance(a, t_ns);
		segment_advance(same, t_ns);
		segment_advance(other, t_ns);
		off_ns = (int64_t)(esc_system_time(segment_esc(a, 0), t_ns) -
				   esc_system_time(segment_esc(steady, 0), t_ns));
		CHECK(llabs(off_ns) <= 5000 * s + 10);
		has_wandered |= llabs(off_ns) > 10000;
		CHECK_EQ(esc_system_time(segment_esc(same, 0), t_ns),
			 esc_system_time(segment_esc(a, 0), t_ns));
	}
	CHECK(has_wandered);
	CHECK(esc_system_time(segment_esc(other, 0), 600000 * (int64_t)MS) !=
	      esc_system_time(segment_esc(a, 0), 600000 * (int64_t)MS));
	segment_destroy(steady);
	segment_destroy(a);
	segment_destroy(same);
	segment_destroy(other);
}

TEST(chip, time_stamps_jitter_by_no_more_than_told)
{
	struct segment *s = one_slave(50, 0, 3);
	int64_t least = INT64_MAX;
	int64_t most = INT64_MIN;

	segment_advance(s, 10 * MS);
	for (int64_t i = 1; i <= 1000; i++) {
		static const uint8_t source[6] = { 2 };
		uint8_t frame[ECAT_FRAME_MAX_BYTES];
		struct ecat_frame_builder fb;
		int64_t t_ns = 10 * MS + i * MS;
		int64_t back_ns;
		int64_t off_ns;

		ecat_frame_begin(&fb, frame, source);
		CHECK(ecat_frame_add(&fb, ECAT_CMD_BWR, 0, 0, ESC_REG_DC_RECEIVE_TIME_PORT, 4) !=
		      NULL);
		CHECK_EQ(segment_frame(s, t_ns, frame, ecat_frame_end(&fb), &back_ns), 0);
		off_ns = (int32_t)(get_le32(segment_esc(s, 0)->reg + ESC_REG_DC_RECEIVE_TIME_PORT) -
				   (uint32_t)esc_system_time(segment_esc(s, 0), t_ns));
		least = off_ns < least ? off_ns : least;
		most = off_ns > most ? off_ns : most;
	}
	CHECK(least >= -60 && least <= -40);
	CHECK(most <= 60 && most >= 40);
	segment_destroy(s);
}
