/* SPDX-License-Identifier: MIT */
#include "program/args_duration.h"

#include "harness/test.h"

static int64_t parsed(const char *text)
{
	char why[ARGS_WHY_BYTES];
	int64_t ns = -1;

	CHECK_EQ(args_duration(text, &ns, why), 0);
	return ns;
}

static const char *refused(const char *text)
{
	static char why[ARGS_WHY_BYTES];
	int64_t ns = -1;

	CHECK(args_duration(text, &ns, why) < 0);
	CHECK_EQ(ns, -1);
	return why;
}

TEST(args_duration, a_value_carries_its_unit_and_a_plain_number_is_in_seconds)
{
	CHECK_EQ(parsed("1.5ms"), 1500000);
	CHECK_EQ(parsed("2"), INT64_C(2000000000));
}

TEST(args_duration, what_is_no_duration_above_0_is_refused)
{
	CHECK_STR(refused("0s"), "\"0s\": expected a duration above 0");
	CHECK_STR(refused("-1s"), "\"-1s\": expected a duration above 0");
	CHECK(strstr(refused("1parsec"), "parsec") != NULL);
}
