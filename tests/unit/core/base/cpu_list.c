/* SPDX-License-Identifier: MIT */
#include "base/cpu_list.h"

#include "harness/test.h"

TEST(cpu_list, cores_and_ranges_are_found)
{
	CHECK_EQ(cpu_list_has("3\n", 3), 1);
	CHECK_EQ(cpu_list_has("3\n", 2), 0);
	CHECK_EQ(cpu_list_has("1-3,5\n", 1), 1);
	CHECK_EQ(cpu_list_has("1-3,5\n", 3), 1);
	CHECK_EQ(cpu_list_has("1-3,5\n", 4), 0);
	CHECK_EQ(cpu_list_has("1-3,5\n", 5), 1);
}

TEST(cpu_list, what_is_no_list_holds_no_core)
{
	CHECK_EQ(cpu_list_has("", 0), 0);
	CHECK_EQ(cpu_list_has("\n", 0), 0);
	CHECK_EQ(cpu_list_has("nonsense", 0), 0);
	CHECK_EQ(cpu_list_has("(null)\n", 0), 0);
	CHECK_EQ(cpu_list_has("0-3", -1), 0);
}
