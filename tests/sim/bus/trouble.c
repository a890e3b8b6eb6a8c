/* SPDX-License-Identifier: MIT */
/* What a user does wrong, and slaves that are not what they should be: one clear line each. */
#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/bus/bus_bench.h"

TEST(trouble, no_slave_is_said_plainly)
{
	static const char *const settings[] = { "bus.scan_timeout=200ms", NULL };
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 1, .seed = 12, .settings = settings });

	segment_power_off(b->segment, 0, bench_now_ns(b));
	CHECK_EQ(bench_find(b), -ENODEV);
	CHECK(strstr(b->error, "no slave answers") != NULL);
	bench_destroy(b);
}

TEST(trouble, missing_slave_is_named_by_position_and_identity)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 13 });

	b->cfg.slave_count = 2;
	b->cfg.slave[1].vendor = 2;
	b->cfg.slave[1].product = 0x04570862;
	CHECK_EQ(bench_find(b), -ENXIO);
	CHECK(strstr(b->error, "slave 1 is missing") != NULL);
	CHECK(strstr(b->error, "0x04570862") != NULL);
	bench_destroy(b);
}

TEST(trouble, cycle_below_a_slave_s_minimum_is_refused_with_the_mend)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 16 });

	b->cfg.cycle_period_ns = 99999;
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), -EPROTO);
	CHECK(strstr(b->error, "slave 0 (") == b->error);
	CHECK(strstr(b->error, "cycle.period 99999 ns is below the slave's minimum of 100000 ns "
			       "(0x1c32:05): set cycle.period to 100us or more") != NULL);
	b->cfg.cycle_period_ns = 100000;
	bench_new_master(b);
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), 0);
	bench_destroy(b);
}

TEST(trouble, blank_eeprom_is_an_error_and_no_hang)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 14 });
	struct esc *esc = segment_esc(b->segment, 1);

	memset(esc->sii, 0xff, esc->sii_bytes);
	CHECK_EQ(bench_find(b), -EPROTO);
	CHECK(strstr(b->error, "slave 1") != NULL);
	CHECK(strstr(b->error, "EEPROM") != NULL);
	memset(esc->sii, 0x00, esc->sii_bytes);
	bench_new_master(b);
	CHECK_EQ(bench_find(b), -EPROTO);
	CHECK(bench_now_ns(b) < 20 * NS_PER_S);
	bench_destroy(b);
}

TEST(trouble, category_that_goes_round_in_circles_ends_the_walk)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .sii = { "el2889" }, .seed = 15 });
	struct esc *esc = segment_esc(b->segment, 0);

	/* 0x80 + 4 + 2 * 0x7ffe is 0x80 again in 16 bits. */
	put_le16(esc->sii + 0x80, 3);
	put_le16(esc->sii + 0x82, 0x7ffe);
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), -EPROTO);
	CHECK(strstr(b->error, "runs past the end") != NULL);
	bench_destroy(b);
}

TEST(trouble, damaged_sii_of_a_real_drive_is_survived)
{
	struct bus_bench *b =
		bench_create(&(struct bench_spec){ .sii = { "akd-damaged" }, .seed = 16 });
	int r = bench_find(b);

	if (r == 0) {
		r = bench_map(b);
	}
	CHECK(r == 0 || r == -EPROTO || r == -EIO);
	CHECK(bench_now_ns(b) < 20 * NS_PER_S);
	bench_destroy(b);
}

TEST(trouble, mode_of_a_slave_that_has_none_is_refused)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .sii = { "el2889" }, .seed = 18 });

	b->cfg.slave_count = 1;
	b->cfg.slave[0].mode = CONFIG_MODE_ONESHOT;
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), -ENOTSUP);
	bench_destroy(b);
}

TEST(trouble, refused_startup_sdo_is_loud)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 1, .seed = 19 });

	b->cfg.sdo_count = 1;
	b->cfg.sdo[0] = (struct config_sdo){
		.index = 0x8000, .subindex = 1, .bytes = 1, .value = 7, .line = 12
	};
	snprintf(b->cfg.path, sizeof(b->cfg.path), "ecdaq.yaml");
	CHECK_EQ(bench_find(b), 0);
	CHECK_EQ(bench_map(b), -EPROTO);
	CHECK(strstr(b->error, "0x8000:01") != NULL);
	CHECK(strstr(b->error, "ecdaq.yaml:12") != NULL);
	CHECK(strstr(b->error, "abort 0x06090030") != NULL);
	bench_destroy(b);
}
