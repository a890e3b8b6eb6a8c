/* SPDX-License-Identifier: MIT */
/* From power-on to OP, and back. */
#include <errno.h>

#include "base/bytes.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "sim/bus/bus_bench.h"
#include "wire/esc_reg.h"

static int64_t edge_ns[LIMIT_SLAVES];
static int64_t spread_max_ns;
static unsigned edge_slaves;

/* Largest distance of two slaves' edges of one period. */
static void on_edge(void *ctx, unsigned slave, int64_t t_ns, uint64_t system_time_ns)
{
	(void)ctx;
	(void)system_time_ns;
	edge_ns[slave] = t_ns;
	for (unsigned i = 0; i < edge_slaves; i++) {
		int64_t apart_ns = llabs(t_ns - edge_ns[i]);

		if (edge_ns[i] != 0 && apart_ns < 500000 && apart_ns > spread_max_ns) {
			spread_max_ns = apart_ns;
		}
	}
}

static void check_counts(struct bus_bench *b, unsigned slaves, unsigned cycles)
{
	static uint64_t before[LIMIT_SLAVES];
	char name[64];

	for (unsigned i = 0; i < slaves; i++) {
		snprintf(name, sizeof(name), "piccolo%u.counter", i);
		before[i] = bench_value(b, name);
	}
	bench_run(b, cycles);
	for (unsigned i = 0; i < slaves; i++) {
		snprintf(name, sizeof(name), "piccolo%u.counter", i);
		CHECK_EQ((uint16_t)(bench_value(b, name) - before[i]), cycles);
	}
}

static void check_line_of(unsigned slaves)
{
	struct bench_spec spec = { .piccolos = slaves, .host_ppm = 50, .seed = slaves };
	struct bus_bench *b;
	int64_t begun_ns;

	for (unsigned i = 0; i < slaves; i++) {
		spec.ppm[i] = i % 2 == 0 ? 100 : -100;
	}
	b = bench_create(&spec);
	begun_ns = bench_now_ns(b);
	bench_bring_up(b);
	printf("%u slaves: OP after %.3f s\n", slaves, (double)(bench_now_ns(b) - begun_ns) * 1e-9);
	CHECK_EQ(bus_plan(b->bus)->wkc_expected, 3 * slaves);
	CHECK_EQ(bus_plan(b->bus)->chunk_count, 1);
	bench_run(b, 200);
	edge_slaves = slaves;
	spread_max_ns = 0;
	memset(edge_ns, 0, sizeof(edge_ns));
	segment_sync0_to(b->segment, on_edge, NULL);
	check_counts(b, slaves, 1000);
	printf("%u slaves: SYNC0 within %lld ns\n", slaves, (long long)spread_max_ns);
	CHECK(spread_max_ns < 100);
	CHECK_EQ(b->last.status, EXCHANGE_OK);
	CHECK_EQ(b->last.wkc, 3 * slaves);
	CHECK_EQ(b->last.al_status, AL_OP);
	CHECK_EQ(b->last.al_wkc, slaves);
	CHECK_EQ(bench_watch(b).is_all_op, 1);
	CHECK_EQ(bench_stop(b), 0);
	bench_destroy(b);
}

TEST(bring_up, sync_type_and_minimum_cycle_are_read_and_shown)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 17 });
	const struct slave_status *page = &b->page->slave[0];

	bench_bring_up(b);
	bench_watch(b);
	CHECK_EQ(atomic_load(&page->output_sync_type), 2);
	CHECK_EQ(atomic_load(&page->input_sync_type), 2);
	CHECK_EQ(atomic_load(&page->minimum_cycle_ns), 100000);
	bench_destroy(b);
}

TEST(bring_up, one_piccolo_comes_to_op_and_counts)
{
	check_line_of(1);
}

TEST(bring_up, two_piccolos_sample_at_the_same_edge)
{
	check_line_of(2);
}

TEST(bring_up, eight_piccolos_sample_at_the_same_edge)
{
	check_line_of(8);
}

TEST(bring_up, sixty_four_piccolos_sample_at_the_same_edge)
{
	check_line_of(64);
}

TEST(bring_up, channels_are_named_typed_and_scaled)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 3 });
	const struct slave_info *slaves;
	const struct channel *ch;
	size_t count;

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	slaves = bus_slaves(b->bus, &count);
	CHECK_EQ(count, 2);
	CHECK_STR(slaves[1].name, "piccolo1");
	CHECK_EQ(slaves[0].is_dc_reference, 1);
	CHECK_EQ(slaves[0].dc_delay_ns, 0);
	CHECK(slaves[1].dc_delay_ns > 0);
	CHECK_EQ(slaves[1].input_bits, 104);
	CHECK_EQ(slaves[1].output_bits, 72);
	bus_channels(b->bus, &count);
	CHECK_EQ(count, 12);
	ch = bench_channel(b, "piccolo1.led");
	CHECK_EQ(ch->direction, CHANNEL_OUTPUT);
	CHECK_EQ(ch->type, CHANNEL_BOOL);
	CHECK_EQ(ch->bit_offset, 72);
	ch = bench_channel(b, "piccolo1.oneshot_time");
	CHECK_EQ(ch->bit_offset, 80);
	CHECK_EQ(ch->bit_len, 64);
	ch = bench_channel(b, "piccolo0.adc");
	CHECK_EQ(ch->bit_offset, 144);
	CHECK_EQ(ch->type, CHANNEL_UINT);
	CHECK_STR(ch->unit, "V");
	CHECK(ch->scale > 0.00080 && ch->scale < 0.00081);
	CHECK_STR(bus_channels(b->bus, &count)[slaves[1].counter_channel].name, "piccolo1.counter");
	CHECK_EQ(bus_plan(b->bus)->image_bytes, 44);
	CHECK_EQ(bus_plan(b->bus)->output_bytes, 18);
	bench_destroy(b);
}

TEST(bring_up, outputs_reach_the_board)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 4 });

	bench_bring_up(b);
	bench_run(b, 50);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b->segment, 1)), 0);
	b->image[9] = 1;
	bench_run(b, 50);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b->segment, 0)), 0);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b->segment, 1)), 1);
	CHECK_EQ(b->image[9], 1);
	bench_destroy(b);
}

TEST(bring_up, terminals_simulated_from_their_sii_reach_op)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){
		.sii = { "ek1100", "el2828", "el2889" }, .ppm = { 30, -30, 60 }, .seed = 5 });
	const struct slave_info *slaves;
	size_t count;

	bench_bring_up(b);
	slaves = bus_slaves(b->bus, &count);
	CHECK_EQ(count, 3);
	CHECK_STR(slaves[0].name, "ek1100_0");
	CHECK_STR(slaves[1].name, "el2828_1");
	CHECK_EQ(slaves[1].has_dc, 0);
	CHECK_EQ(slaves[2].has_dc, 1);
	CHECK_EQ(bus_plan(b->bus)->wkc_expected, 4);
	CHECK_EQ(bus_plan(b->bus)->image_bytes, 3);
	bus_channels(b->bus, &count);
	CHECK_EQ(count, 24);
	bench_run(b, 100);
	CHECK_EQ(b->last.status, EXCHANGE_OK);
	CHECK_EQ(bench_stop(b), 0);
	bench_destroy(b);
}

TEST(bring_up, mixed_line_packs_bits_and_bytes)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){
		.piccolos = 1, .sii = { "ek1100", "el1008", "el1008" }, .seed = 6 });
	size_t count;

	bench_bring_up(b);
	bench_run(b, 100);
	CHECK_EQ(b->last.status, EXCHANGE_OK);
	CHECK_EQ(b->last.wkc, 3 + 1 + 1);
	bus_channels(b->bus, &count);
	CHECK_EQ(count, 6 + 8 + 8);
	CHECK_EQ(bench_channel(b, "el1008_3.channel_8_input")->bit_len, 1);
	CHECK_EQ(bench_watch(b).is_all_op, 1);
	bench_destroy(b);
}

TEST(bring_up, many_kinds_of_real_images_work_in_one_line)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){
		.piccolos = 1,
		.sii = { "ek1100", "el1008", "el2004", "el3204", "el4002", "el2521-0000", "akd" },
		.seed = 21 });
	size_t count;

	bench_bring_up(b);
	bench_run(b, 100);
	CHECK_EQ(b->last.status, EXCHANGE_OK);
	bus_slaves(b->bus, &count);
	CHECK_EQ(count, 8);
	CHECK_EQ(bench_watch(b).is_all_op, 1);
	CHECK_EQ(bench_channel(b, "el2004_3.channel_3_output")->direction, CHANNEL_OUTPUT);
	CHECK_EQ(bench_stop(b), 0);
	bench_destroy(b);
}

TEST(bring_up, slave_that_announces_coe_answers_or_is_an_error)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .sii = { "akd" }, .seed = 7 });
	int r = bench_find(b);

	CHECK_EQ(r, 0);
	r = bench_map(b);
	if (r < 0) {
		CHECK_EQ(r, -EIO);
		CHECK(strstr(b->error, "no answer from its mailbox") != NULL);
	} else {
		CHECK(bus_plan(b->bus)->image_bytes > 0);
	}
	bench_destroy(b);
}

/* T14 */
TEST(bring_up, slave_without_clock_between_two_with_clocks_is_no_obstacle)
{
	static const char *const settings[] = { "slaves[0].assign_activate=0x0300",
						"slaves[1].name=none",
						"slaves[2].assign_activate=0x0300", NULL };
	struct bus_bench *b =
		bench_create(&(struct bench_spec){ .sii = { "el1008", "el1008", "el1008" },
						   .clockless = 1u << 1,
						   .clocked = 1u << 0 | 1u << 2,
						   .ppm = { 100, 0, -100 },
						   .seed = 8,
						   .settings = settings });
	const struct slave_info *slaves;
	size_t count;

	bench_bring_up(b);
	slaves = bus_slaves(b->bus, &count);
	CHECK_EQ(slaves[1].has_dc, 0);
	CHECK_EQ(slaves[2].has_dc, 1);
	bench_run(b, 200);
	edge_slaves = 3;
	spread_max_ns = 0;
	memset(edge_ns, 0, sizeof(edge_ns));
	segment_sync0_to(b->segment, on_edge, NULL);
	bench_run(b, 200);
	CHECK(segment_esc(b->segment, 0)->sync.edges >= 200);
	CHECK(segment_esc(b->segment, 2)->sync.edges >= 200);
	CHECK(spread_max_ns < 100);
	CHECK(b->last.dc_diff_ns < 100);
	bench_destroy(b);
}

/* T13: the 32-bit receive times wrap between the ports, or at half. */
static int32_t delay_with_start(uint64_t start_ns)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){
		.piccolos = 3, .seed = 9, .clock_start_ns = { start_ns, start_ns, start_ns } });
	const struct slave_info *slaves;
	int32_t delay_ns;
	size_t count;

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	slaves = bus_slaves(b->bus, &count);
	CHECK(slaves[1].dc_delay_ns > 0);
	CHECK(slaves[2].dc_delay_ns > slaves[1].dc_delay_ns);
	delay_ns = slaves[2].dc_delay_ns;
	bench_destroy(b);
	return delay_ns;
}

TEST(bring_up, delays_do_not_depend_on_when_receive_times_wrap)
{
	int32_t wanted_ns = delay_with_start(1000);
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 3, .seed = 9 });
	int64_t latch_ns;

	/* Where in time the latch falls, to put the wrap there. */
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bus_map(b->bus, b->error), 0);
	latch_ns = bench_now_ns(b);
	bench_destroy(b);
	for (int64_t early_ns = -2000000; early_ns <= 2000000; early_ns += 50000) {
		int32_t off =
			delay_with_start((uint64_t)((INT64_C(1) << 32) - latch_ns + early_ns)) -
			wanted_ns;

		CHECK(off >= -20 && off <= 20);
	}
}

TEST(bring_up, wall_clock_before_2000_is_no_negative_time)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){
		.piccolos = 2, .seed = 10, .tai_start_ns = 1, .ppm = { 50, -50 } });

	bench_bring_up(b);
	bench_run(b, 200);
	CHECK(b->last.dc_time_ns > 0);
	CHECK(b->last.dc_time_ns < 100 * NS_PER_S);
	bench_destroy(b);
}

TEST(bring_up, watchdog_is_programmed_and_read_back)
{
	static const char *const settings[] = { "bus.watchdog=50ms", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 1, .seed = 11, .settings = settings });
	struct esc *esc = segment_esc(b->segment, 0);

	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	CHECK_EQ(get_le16(esc->reg + ESC_REG_WATCHDOG_DIVIDER), 0x09c2);
	CHECK_EQ(get_le16(esc->reg + ESC_REG_WATCHDOG_TIME_PD), 500);
	bench_destroy(b);
}

TEST(bring_up, one_shot_slave_gets_its_sync_unit)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 17 });

	b->cfg.slave_count = 2;
	b->cfg.slave[0].mode = CONFIG_MODE_ONESHOT;
	b->cfg.slave[1].mode = CONFIG_MODE_ONESHOT;
	bench_bring_up(b);
	CHECK_EQ(segment_esc(b->segment, 0)->reg[ESC_REG_DC_CYCLIC_CONTROL] & 1, 1);
	bench_run(b, 100);
	CHECK_EQ(bench_value(b, "piccolo1.status") & 1, 1);
	CHECK_EQ(bench_value(b, "piccolo1.counter"), 0);
	CHECK_EQ(bench_stop(b), 0);
	/* T09 with a SYNC unit that belongs to the PDI: the next run has it back. */
	b->cfg.slave[0].mode = CONFIG_MODE_PERIODIC;
	b->cfg.slave[1].mode = CONFIG_MODE_PERIODIC;
	bench_new_master(b);
	bench_bring_up(b);
	check_counts(b, 2, 100);
	bench_destroy(b);
}

TEST(bring_up, sdo_values_go_both_ways_in_op)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 20 });
	uint8_t data[64] = { 25, 0 };
	uint32_t abort = 0;
	size_t len = 2;

	bench_bring_up(b);
	CHECK_EQ(bus_sdo_write(b->bus, 0, 0x8000, 2, data, 2, &abort), 0);
	CHECK_EQ(bus_sdo_read(b->bus, 0, 0x8000, 2, data, &len, &abort), 0);
	CHECK_EQ(len, 2);
	CHECK_EQ(get_le16(data), 25);
	len = sizeof(data);
	CHECK_EQ(bus_sdo_read(b->bus, 0, 0x1008, 0, data, &len, &abort), 0);
	data[len] = '\0';
	CHECK_STR((char *)data, "FB1111-Piccolo");
	len = sizeof(data);
	CHECK_EQ(bus_sdo_read(b->bus, 0, 0x5555, 0, data, &len, &abort), -EREMOTEIO);
	CHECK_EQ(abort, 0x06020000);
	CHECK_EQ(bus_sdo_read(b->bus, 7, 0x5555, 0, data, &len, &abort), -ENODEV);
	CHECK_EQ(b->lost, 0);
	bench_destroy(b);
}
