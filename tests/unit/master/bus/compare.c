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

	CHECK_EQ(compare_slaves(make_config(0), found, 2, error, sizeof(error)), 0);
	CHECK_STR(error, "");
}

TEST(compare, expected_slaves_are_accepted_and_more_behind_them)
{
	char error[256] = "";

	CHECK_EQ(compare_slaves(make_config(2), found, 2, error, sizeof(error)), 0);
	CHECK_EQ(compare_slaves(make_config(1), found, 2, error, sizeof(error)), 0);
}

TEST(compare, wrong_slave_is_reported_with_both_identities)
{
	struct config *cfg = make_config(2);
	char error[256] = "";

	cfg->slave[1].product = 0x11;
	CHECK_EQ(compare_slaves(cfg, found, 2, error, sizeof(error)), -ENXIO);
	CHECK_STR(error, "slave 1: wrong identity: expected vendor 0x00000002 product 0x00000011 "
			 "revision any, "
			 "found vendor 0x00000002 product 0x0b0c3052 revision 0x00110000 (EL2828)");
}

TEST(compare, wrong_revision_and_wrong_alias_count)
{
	struct config *cfg = make_config(2);
	char error[256] = "";

	cfg->slave[0].revision = 1;
	CHECK_EQ(compare_slaves(cfg, found, 2, error, sizeof(error)), -ENXIO);
	cfg->slave[0].revision = 0;
	cfg->slave[1].alias = 8;
	error[0] = '\0';
	CHECK_EQ(compare_slaves(cfg, found, 2, error, sizeof(error)), -ENXIO);
	CHECK(strstr(error, "alias 8") != NULL);
	CHECK(strstr(error, "alias 7") != NULL);
}

TEST(compare, missing_slave_is_reported_with_name_and_count)
{
	struct config *cfg = make_config(3);
	char error[256] = "";

	snprintf(cfg->slave[2].name, sizeof(cfg->slave[2].name), "pump");
	cfg->slave[2].vendor = 0x21;
	CHECK_EQ(compare_slaves(cfg, found, 2, error, sizeof(error)), -ENXIO);
	CHECK_STR(error, "slave 2 pump is missing: 2 found, 3 expected; expected vendor 0x00000021 "
			 "product any "
			 "revision any");
}

TEST(compare, unexpected_slave_is_reported_with_presence_exact)
{
	struct config *cfg = make_config(1);
	char error[256] = "";

	cfg->bus_presence = CONFIG_EXACT_SLAVES;
	CHECK_EQ(compare_slaves(cfg, found, 2, error, sizeof(error)), -ENXIO);
	CHECK_STR(error, "slave 1 is unexpected: 2 found, 1 expected; found vendor 0x00000002 "
			 "product 0x0b0c3052 "
			 "revision 0x00110000 (EL2828)");
	CHECK_EQ(compare_slaves(cfg, found, 1, error, sizeof(error)), 0);
}

TEST(compare, small_buffer_is_not_overrun)
{
	struct config *cfg = make_config(2);
	char error[24];

	memset(error, 'x', sizeof(error));
	cfg->slave[1].product = 0x11;
	CHECK_EQ(compare_slaves(cfg, found, 2, error, 16), -ENXIO);
	CHECK(strlen(error) == 15);
	CHECK_EQ(error[16], 'x');
}
