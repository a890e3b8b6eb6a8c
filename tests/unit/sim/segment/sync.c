/* SPDX-License-Identifier: MIT */
/* The SYNC unit: when its edges come, and when they do not. */
#include "base/bytes.h"
#include "dc_master.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum {
	ONE = BENCH_STATION,
	PDI_SPI = 0x05,
	BOTH_DC_UNITS = 0x0c,
	MS = 1000000,
	EDGES_MAX = 256,
	TICK_NS = 10,
	SYNC0_MAPPED = 0x08, /* 0x0151 */
	SYNC1_MAPPED = 0x80,
};

static struct {
	unsigned count;
	int64_t t_ns[EDGES_MAX];
	uint64_t system_ns[EDGES_MAX];
} edges;

static void take_edge(void *ctx, unsigned slave, int64_t t_ns, uint64_t system_time_ns)
{
	(void)ctx;
	(void)slave;
	CHECK(edges.count < EDGES_MAX);
	edges.t_ns[edges.count] = t_ns;
	edges.system_ns[edges.count] = system_time_ns;
	edges.count++;
}

static struct bench *watched(const struct bench_slave *slave)
{
	struct bench *b = bench_create(slave, 1);

	edges.count = 0;
	segment_sync0_to(b->segment, take_edge, NULL);
	return b;
}

static struct bench *one(double ppm)
{
	return watched(
		&(struct bench_slave){ .pdi = PDI_SPI, .config = BOTH_DC_UNITS, .ppm = ppm });
}

static uint64_t now_of(struct bench *b)
{
	return bench_read64(b, ONE, ESC_REG_DC_SYSTEM_TIME);
}

TEST(sync, edges_come_at_the_start_time_and_every_cycle_from_there)
{
	struct bench *b = one(0.0);
	uint64_t start = now_of(b) + 5 * MS + 123450;

	dc_master_sync0(b, 0, start, 250000);
	bench_wait(b, 5 * MS + 20 * 250000);
	CHECK(edges.count >= 18);
	for (unsigned n = 0; n < edges.count; n++) {
		CHECK_EQ(edges.system_ns[n], start + n * 250000);
		CHECK_EQ(edges.t_ns[n], (int64_t)edges.system_ns[n]);
	}
	CHECK_EQ(segment_esc(b->segment, 0)->sync.edges, edges.count);
	bench_destroy(b);
}

TEST(sync, edges_follow_the_slaves_own_clock_to_its_tick)
{
	struct bench *b = one(100.0);
	uint64_t start = now_of(b) + 2 * MS;

	dc_master_sync0(b, 0, start, MS);
	bench_wait(b, 100 * MS);
	CHECK(edges.count > 90);
	for (unsigned n = 1; n < edges.count; n++) {
		double wanted = n * (MS / (1.0 + 100e-6));
		double got = (double)(edges.t_ns[n] - edges.t_ns[0]);

		CHECK(got - wanted > -1.5 * TICK_NS && got - wanted < 1.5 * TICK_NS);
	}
	bench_destroy(b);
}

TEST(sync, status_shows_a_first_pulse_that_is_still_to_come)
{
	struct bench *b = one(0.0);

	CHECK_EQ(bench_read8(b, ONE, ESC_REG_DC_ACTIVATION_STATUS), 0);
	dc_master_sync0(b, 0, now_of(b) + 10 * MS, MS);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_DC_ACTIVATION_STATUS), 0x01);
	bench_wait(b, 11 * MS);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_DC_ACTIVATION_STATUS), 0x00);
	bench_destroy(b);
}

TEST(sync, the_start_register_reads_as_the_next_edge_while_it_runs)
{
	struct bench *b = one(0.0);
	uint64_t start = now_of(b) + 2 * MS;
	uint64_t next;

	dc_master_sync0(b, 0, start, MS);
	CHECK_EQ(bench_read64(b, ONE, ESC_REG_DC_START_TIME), start);
	bench_wait(b, 10 * MS + MS / 2);
	next = bench_read64(b, ONE, ESC_REG_DC_START_TIME);
	CHECK_EQ((next - start) % MS, 0);
	CHECK(next > (uint64_t)b->now_ns && next <= (uint64_t)b->now_ns + MS);
	/* Written while it runs it changes nothing. */
	bench_write64(b, ONE, ESC_REG_DC_START_TIME, 5);
	CHECK(bench_read64(b, ONE, ESC_REG_DC_START_TIME) >= next);
	bench_destroy(b);
}

TEST(sync, cycle_time_0_fires_once_and_again_only_after_switching_off)
{
	struct bench *b = one(0.0);

	dc_master_sync0(b, 0, now_of(b) + 2 * MS, 0);
	bench_wait(b, 50 * MS);
	CHECK_EQ(edges.count, 1);
	bench_write64(b, ONE, ESC_REG_DC_START_TIME, now_of(b) + 2 * MS);
	bench_write8(b, ONE, ESC_REG_DC_ACTIVATION, 3);
	bench_wait(b, 50 * MS);
	CHECK_EQ(edges.count, 1);
	dc_master_sync0(b, 0, now_of(b) + 2 * MS, 0);
	bench_wait(b, 50 * MS);
	CHECK_EQ(edges.count, 2);
	bench_destroy(b);
}

TEST(sync, a_start_in_the_past_never_fires_with_64_bits)
{
	struct bench *b = one(0.0);

	dc_master_sync0(b, 0, now_of(b) - 1000, MS);
	bench_wait(b, INT64_C(20000000000));
	CHECK_EQ(edges.count, 0);
	/* Pending for ever, and said to be out of the near future. */
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_DC_ACTIVATION_STATUS), 0x05);
	bench_destroy(b);
}

TEST(sync, a_start_in_the_past_fires_after_the_wrap_with_32_bits)
{
	struct esc_features small = esc_et1100;
	struct bench *b;
	uint32_t now;
	int64_t from_ns;

	small.dc = ESC_DC_32;
	b = watched(&(struct bench_slave){ .features = &small,
					   .pdi = PDI_SPI,
					   .config = BOTH_DC_UNITS,
					   .clock_ns = UINT64_C(0xfffffff0) });
	now = bench_read32(b, ONE, ESC_REG_DC_SYSTEM_TIME);
	from_ns = b->now_ns;
	bench_write32(b, ONE, ESC_REG_DC_START_TIME, now - 1000);
	bench_write32(b, ONE, ESC_REG_DC_SYNC0_CYCLE, 100 * MS);
	bench_write8(b, ONE, ESC_REG_DC_ACTIVATION, 3);
	bench_wait(b, INT64_C(4290000000));
	CHECK_EQ(edges.count, 0);
	bench_wait(b, 100 * MS);
	CHECK_EQ(edges.count, 1);
	/* 2^32 ns less the microsecond; the wire to it is 5 ns. */
	CHECK(llabs(edges.t_ns[0] - from_ns - (INT64_C(4294967296) - 1000)) <= TICK_NS);
	bench_destroy(b);
}

TEST(sync, an_offset_that_jumps_over_the_next_edge_silences_it)
{
	struct bench *b = one(0.0);
	uint64_t start = now_of(b) + 5 * MS;

	dc_master_sync0(b, 0, start, MS);
	bench_wait(b, 10 * MS);
	CHECK(edges.count > 3);
	edges.count = 0;
	bench_write64(b, ONE, ESC_REG_DC_SYSTEM_TIME_OFFSET, 500 * MS);
	bench_wait(b, 50 * MS);
	CHECK_EQ(edges.count, 0);
	bench_destroy(b);
}

TEST(sync, the_unit_belongs_to_the_pdi_when_0980_says_so)
{
	struct bench *b = one(0.0);
	uint8_t start[8];
	uint8_t on = 3;
	uint8_t data[1] = { 3 };

	put_le64(start, now_of(b) + 10 * MS);
	bench_pdi_write(b, 0, ESC_REG_DC_START_TIME, start, 8); /* not yet */
	CHECK_EQ(bench_read64(b, ONE, ESC_REG_DC_START_TIME), 0);
	bench_write8(b, ONE, ESC_REG_DC_CYCLIC_CONTROL, 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, ONE, ESC_REG_DC_ACTIVATION, data, 1), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, ONE, ESC_REG_DC_START_TIME, start, 8), 0);
	bench_pdi_write(b, 0, ESC_REG_DC_START_TIME, start, 8);
	bench_pdi_write(b, 0, ESC_REG_DC_ACTIVATION, &on, 1);
	bench_wait(b, 20 * MS);
	CHECK_EQ(edges.count, 1);
	CHECK_EQ(edges.system_ns[0], get_le64(start));
	bench_destroy(b);
}

TEST(sync, without_pulse_length_the_pin_stays_up_until_the_pdi_reads_its_status)
{
	struct bench *b = one(0.0);
	uint8_t status;

	put_le16(segment_esc(b->segment, 0)->reg + ESC_REG_DC_PULSE_LENGTH, 0);
	dc_master_sync0(b, 0, now_of(b) + 2 * MS, MS);
	bench_wait(b, 20 * MS);
	CHECK_EQ(edges.count, 1);
	bench_pdi_read(b, 0, ESC_REG_DC_SYNC0_STATUS, &status, 1);
	CHECK_EQ(status, 1);
	bench_pdi_read(b, 0, ESC_REG_DC_SYNC0_STATUS, &status, 1);
	CHECK_EQ(status, 0);
	bench_wait(b, MS);
	CHECK_EQ(edges.count, 2);
	bench_destroy(b);
}

TEST(sync, sync0_is_an_al_event_only_where_0151_maps_it)
{
	static const uint8_t pins[] = { 0, SYNC0_MAPPED };

	for (unsigned i = 0; i < 2; i++) {
		struct bench *b = watched(&(struct bench_slave){
			.pdi = PDI_SPI, .config = BOTH_DC_UNITS, .sync_pins = pins[i] });
		uint8_t ignored;
		uint32_t event;

		dc_master_sync0(b, 0, now_of(b) + 2 * MS, 0);
		bench_wait(b, 5 * MS);
		bench_pdi_read(b, 0, ESC_REG_AL_EVENT_REQUEST, &event, 4);
		CHECK_EQ(event & ESC_AL_EVENT_SYNC0, i == 0 ? 0 : ESC_AL_EVENT_SYNC0);
		bench_pdi_read(b, 0, ESC_REG_DC_SYNC0_STATUS, &ignored, 1);
		bench_pdi_read(b, 0, ESC_REG_AL_EVENT_REQUEST, &event, 4);
		CHECK_EQ(event & ESC_AL_EVENT_SYNC0, 0);
		bench_destroy(b);
	}
}

TEST(sync, sync1_follows_sync0_by_its_cycle_time)
{
	struct bench *b = watched(&(struct bench_slave){
		.pdi = PDI_SPI, .config = BOTH_DC_UNITS, .sync_pins = SYNC1_MAPPED });
	struct esc *esc = segment_esc(b->segment, 0);
	uint64_t start = now_of(b) + 2 * MS;

	bench_write64(b, ONE, ESC_REG_DC_START_TIME, start);
	bench_write32(b, ONE, ESC_REG_DC_SYNC0_CYCLE, 10 * MS);
	bench_write32(b, ONE, ESC_REG_DC_SYNC1_CYCLE, 3 * MS);
	bench_write8(b, ONE, ESC_REG_DC_ACTIVATION, 7);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_DC_ACTIVATION_STATUS), 0x03);
	segment_advance(b->segment, (int64_t)start + 3 * MS - TICK_NS);
	CHECK_EQ(edges.count, 1);
	CHECK_EQ(esc->al_event & ESC_AL_EVENT_SYNC1, 0);
	b->now_ns = (int64_t)start + MS;
	CHECK_EQ(bench_read64(b, ONE, ESC_REG_DC_NEXT_SYNC1), start + 3 * MS);
	segment_advance(b->segment, (int64_t)start + 3 * MS + TICK_NS);
	CHECK_EQ(esc->al_event & ESC_AL_EVENT_SYNC1, ESC_AL_EVENT_SYNC1);
	bench_destroy(b);
}

TEST(sync, switching_off_takes_the_edges_away)
{
	struct bench *b = one(0.0);

	dc_master_sync0(b, 0, now_of(b) + 2 * MS, MS);
	bench_wait(b, 10 * MS);
	bench_write8(b, ONE, ESC_REG_DC_ACTIVATION, 0);
	edges.count = 0;
	bench_wait(b, 10 * MS);
	CHECK_EQ(edges.count, 0);
	CHECK_EQ(bench_read8(b, ONE, ESC_REG_DC_ACTIVATION_STATUS), 0);
	bench_destroy(b);
}
