/* SPDX-License-Identifier: MIT */
#include "bus/compare.h"

#include <errno.h>

#include "harness/test.h"

static const struct slave_info found[] = {
	{ .vendor = 2, .product = 0x04570862, .revision = 0x0258008d, .device = "FB1111-Piccolo" },
	{ .vendor = 2,
	  .product = 0x0b0c3052,
	  .revision = 0x00110000,
	  .alias = 7,
	  .device = "EL2828" },
};

static struct config *make_config(size_t slaves)
{
	static struct config cfg;

	memset(&cfg, 0, sizeof(cfg));
	cfg.slave_count = slaves;
	for (size_t i = 0; i < slaves && i < 2; i++) {
		cfg.slave[i].vendor = found[i].vendor;
		cfg.slave[i].product = found[i].product;
	}
	return &cfg;
}

TEST(compare, no_expected_slaves_accept_any)
{
	char error[256] = "";

	CHECK_EQ(compare_slaves(make_config(0), found, NULL, 2, error, sizeof(error)), 0);
	CHECK_STR(error, "");
}

TEST(compare, expected_slaves_are_accepted_and_more_behind_them)
{
	char error[256] = "";

	CHECK_EQ(compare_slaves(make_config(2), found, NULL, 2, error, sizeof(error)), 0);
	CHECK_EQ(compare_slaves(make_config(1), found, NULL, 2, error, sizeof(error)), 0);
}

TEST(compare, wrong_slave_is_reported_with_both_identities)
{
	struct config *cfg = make_config(2);
	char error[256] = "";

	cfg->slave[1].product = 0x11;
	CHECK_EQ(compare_slaves(cfg, found, NULL, 2, error, sizeof(error)), -ENXIO);
	CHECK_STR(error, "slave 1: wrong identity: expected vendor 0x00000002 product 0x00000011 "
			 "revision any, "
			 "found vendor 0x00000002 product 0x0b0c3052 revision 0x00110000 (EL2828)");
}

TEST(compare, wrong_revision_and_wrong_alias_count)
{
	struct config *cfg = make_config(2);
	char error[256] = "";

	cfg->slave[0].revision = 1;
	CHECK_EQ(compare_slaves(cfg, found, NULL, 2, error, sizeof(error)), -ENXIO);
	cfg->slave[0].revision = 0;
	cfg->slave[1].alias = 8;
	error[0] = '\0';
	CHECK_EQ(compare_slaves(cfg, found, NULL, 2, error, sizeof(error)), -ENXIO);
	CHECK(strstr(error, "alias 8") != NULL);
	CHECK(strstr(error, "alias 7") != NULL);
}

TEST(compare, missing_slave_is_reported_with_name_and_count)
{
	struct config *cfg = make_config(3);
	char error[256] = "";

	snprintf(cfg->slave[2].name, sizeof(cfg->slave[2].name), "pump");
	cfg->slave[2].vendor = 0x21;
	CHECK_EQ(compare_slaves(cfg, found, NULL, 2, error, sizeof(error)), -ENXIO);
	CHECK_STR(error, "slave 2 pump is missing: 2 found, 3 expected; expected vendor 0x00000021 "
			 "product any "
			 "revision any");
}

TEST(compare, unexpected_slave_is_reported_with_presence_exact)
{
	struct config *cfg = make_config(1);
	char error[256] = "";

	cfg->bus_presence = CONFIG_EXACT_SLAVES;
	CHECK_EQ(compare_slaves(cfg, found, NULL, 2, error, sizeof(error)), -ENXIO);
	CHECK_STR(error, "slave 1 is unexpected: 2 found, 1 expected; found vendor 0x00000002 "
			 "product 0x0b0c3052 "
			 "revision 0x00110000 (EL2828)");
	CHECK_EQ(compare_slaves(cfg, found, NULL, 1, error, sizeof(error)), 0);
}

TEST(compare, small_buffer_is_not_overrun)
{
	struct config *cfg = make_config(2);
	char error[24];

	memset(error, 'x', sizeof(error));
	cfg->slave[1].product = 0x11;
	CHECK_EQ(compare_slaves(cfg, found, NULL, 2, error, 16), -ENXIO);
	CHECK(strlen(error) == 15);
	CHECK_EQ(error[16], 'x');
}

/* --- binding --- */

static const struct slave_info three[] = {
	{ .vendor = 2, .product = 1, .revision = 5, .serial = 11 },
	{ .vendor = 2, .product = 1, .revision = 5, .serial = 12 },
	{ .vendor = 2, .product = 9, .revision = 5 },
};

static struct config *want_three(void)
{
	struct config *cfg = make_config(3);

	for (size_t i = 0; i < 3; i++) {
		cfg->slave[i] = (struct config_slave){ .vendor = 2, .product = three[i].product };
		snprintf(cfg->slave[i].name, sizeof(cfg->slave[i].name), "s%zu", i);
	}
	return cfg;
}

TEST(compare, an_absent_optional_slave_is_left_out_and_those_behind_it_keep_their_settings)
{
	struct config *cfg = want_three();
	static struct config bound;
	int config[3];

	cfg->slave[1].is_optional = 1;
	cfg->slave[2].alias = 0;
	cfg->sdo_count = 2;
	cfg->sdo[0] = (struct config_sdo){ .slave_pos = 1, .index = 0x8000 };
	cfg->sdo[1] = (struct config_sdo){ .slave_pos = 2, .index = 0x9000 };
	cfg->output_count = 2;
	snprintf(cfg->output[0].channel, sizeof(cfg->output[0].channel), "s1.led");
	snprintf(cfg->output[1].channel, sizeof(cfg->output[1].channel), "s2.led");
	CHECK_EQ(compare_bind(cfg, (struct slave_info[]){ three[0], three[2] }, NULL, 2, config),
		 0);
	CHECK_EQ(config[0], 0);
	CHECK_EQ(config[1], 2);
	compare_apply(cfg, config, 2, &bound);
	CHECK_EQ(bound.slave_count, 2);
	CHECK_STR(bound.slave[1].name, "s2");
	CHECK_EQ(bound.sdo_count, 1);
	CHECK_EQ(bound.sdo[0].index, 0x9000);
	CHECK_EQ(bound.sdo[0].slave_pos, 1);
	CHECK_EQ(bound.output_count, 1);
	CHECK_STR(bound.output[0].channel, "s2.led");
	/* Present, it is bound as ever. */
	CHECK_EQ(compare_bind(cfg, three, NULL, 3, config), 0);
	CHECK_EQ(config[1], 1);
}

TEST(compare, of_two_equal_slaves_the_serial_number_decides_which_is_absent)
{
	struct config *cfg = want_three();
	char error[256] = "";
	int config[3];

	cfg->slave[0].is_optional = 1;
	cfg->slave[0].serial = 11;
	cfg->slave[1].serial = 12;
	CHECK_EQ(compare_bind(cfg, three + 1, NULL, 2, config), 0);
	CHECK_EQ(config[0], 1);
	CHECK_EQ(config[1], 2);
	/* Without serial numbers, the first that fits. */
	cfg->slave[0].serial = 0;
	cfg->slave[1].serial = 0;
	CHECK_EQ(compare_bind(cfg, three + 1, NULL, 2, config), 0);
	CHECK_EQ(config[0], 1);
	cfg->slave[0].is_optional = 0;
	CHECK_EQ(compare_bind(cfg, three + 1, NULL, 2, config), -ENXIO);
	CHECK_EQ(compare_slaves(cfg, three + 1, NULL, 2, error, sizeof(error)), -ENXIO);
}

TEST(compare, exchanged_slaves_are_both_named)
{
	struct config *cfg = want_three();
	const uint16_t id[3] = { 2, 1, 0 };
	char error[256] = "";

	cfg->slave[0].identification = 1;
	cfg->slave[1].identification = 2;
	CHECK_EQ(compare_slaves(cfg, three, id, 3, error, sizeof(error)), -ENXIO);
	CHECK_STR(error,
		  "slave 0 s0: wrong identity: expected vendor 0x00000002 product 0x00000001 "
		  "revision any identification 1, found vendor 0x00000002 product 0x00000001 "
		  "revision 0x00000005 identification 2, which is slave 1 s1");
}

TEST(compare, a_slave_missing_among_others_in_another_order_is_named)
{
	struct config *cfg = want_three();
	const uint16_t id[3] = { 3, 1 };
	char error[256] = "";

	for (uint16_t i = 0; i < 3; i++) {
		cfg->slave[i].identification = (uint16_t)(i + 1);
		cfg->slave[i].product = 1;
	}
	CHECK_EQ(compare_slaves(cfg, three, id, 2, error, sizeof(error)), -ENXIO);
	CHECK_STR(error, "slave 1 s1 is missing; slave 0 s0: wrong identity: expected vendor "
			 "0x00000002 product 0x00000001 revision any identification 1, found "
			 "vendor 0x00000002 product 0x00000001 revision 0x00000005 identification "
			 "3, which is slave 2 s2");
	CHECK_EQ(compare_slaves(cfg, three, id, 1, error, sizeof(error)), -ENXIO);
	CHECK(strstr(error, "slave 0 s0 and 1 more are missing; slave 0 s0: wrong") == error);
}

/* The first device found would do for the first slave, too, but is the only one for the second. */
TEST(compare, devices_that_fit_several_slaves_are_counted_once)
{
	struct config *cfg = want_three();
	const uint16_t id[3] = { 3, 1 };
	char error[256] = "";

	cfg->slave[1].identification = 3;
	cfg->slave[2].identification = 2;
	CHECK_EQ(compare_slaves(cfg, three, id, 2, error, sizeof(error)), -ENXIO);
	CHECK(strstr(error, "slave 2 s2 is missing") == error);
}

TEST(compare, revision_policy_allows_newer_or_any_revisions)
{
	struct config *cfg = want_three();
	char error[256] = "";
	const struct {
		enum config_revision policy;
		uint32_t revision;
		int result;
	} cases[] = { { CONFIG_REVISION_EXACT, 5, 0 },         { CONFIG_REVISION_EXACT, 4, -ENXIO },
		      { CONFIG_REVISION_AT_LEAST, 4, 0 },      { CONFIG_REVISION_AT_LEAST, 5, 0 },
		      { CONFIG_REVISION_AT_LEAST, 6, -ENXIO }, { CONFIG_REVISION_ANY, 6, 0 } };

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		cfg->slave[2].revision = cases[i].revision;
		cfg->slave[2].revision_policy = cases[i].policy;
		CHECK_EQ(compare_slaves(cfg, three, NULL, 3, error, sizeof(error)),
			 cases[i].result);
	}
}
