/* SPDX-License-Identifier: MIT */
#include "segment/slave_list.h"

#include <errno.h>

#include "harness/test.h"

enum { CAPACITY = 8 };

static struct slave_list_entry entry[CAPACITY];

static int parsed(const char *text)
{
	char why[128];
	int r = slave_list_parse(text, entry, CAPACITY, why, sizeof(why));

	return r;
}

static const char *refused(const char *text)
{
	static char why[128];

	CHECK_EQ(slave_list_parse(text, entry, CAPACITY, why, sizeof(why)), -EINVAL);
	return why;
}

static void check_entry(int i, const char *name, int parent, unsigned port)
{
	CHECK_STR(entry[i].name, name);
	CHECK_EQ(entry[i].parent, parent);
	if (parent >= 0) {
		CHECK_EQ(entry[i].parent_port, port);
	}
}

TEST(slave_list, names_in_a_row_hang_on_port_1_of_each_other)
{
	CHECK_EQ(parsed("ek1100,el2828,plant:50:1"), 3);
	check_entry(0, "ek1100", -1, 0);
	check_entry(1, "el2828", 0, 1);
	check_entry(2, "plant:50:1", 1, 1);
}

TEST(slave_list, parentheses_hold_a_branch_and_the_comma_goes_on_at_the_next_port)
{
	CHECK_EQ(parsed("ek1100(el2828,el3104),ek1100(el2004)"), 5);
	check_entry(1, "el2828", 0, 1);
	check_entry(2, "el3104", 1, 1);
	check_entry(3, "ek1100", 0, 2);
	check_entry(4, "el2004", 3, 1);
}

TEST(slave_list, a_branch_can_name_its_port_and_branches_can_be_nested)
{
	CHECK_EQ(parsed("a(3:b)(c(2:d)),e"), 5);
	check_entry(1, "b", 0, 3);
	check_entry(2, "c", 0, 1);
	check_entry(3, "d", 2, 2);
	check_entry(4, "e", 0, 2);
}

TEST(slave_list, what_cannot_be_built_is_refused_by_name)
{
	CHECK_STR(refused(""), "expected the name of a slave at ''");
	CHECK_STR(refused("a,,b"), "expected the name of a slave at ',b'");
	CHECK_STR(refused("a,../b"), "expected the name of a slave at '../b'");
	CHECK_STR(refused("a(b"), "')' is missing");
	CHECK_STR(refused("a)"), "unexpected ')'");
	CHECK_STR(refused("a(b)c"), "unexpected 'c'");
	CHECK_STR(refused("a(b)(1:c)"), "a: two slaves at port 1");
	CHECK_STR(refused("a(0:b)"), "a: ports for other slaves are 1 to 3");
	CHECK_STR(refused("a(4:b)"), "a: ports for other slaves are 1 to 3");
	CHECK_STR(refused("a(b)(2:c)(3:d),e"), "a: no port is left");
	CHECK_STR(refused("a,b,c,d,e,f,g,h,i"), "more than 8 slaves");
}
