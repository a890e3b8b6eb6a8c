/* SPDX-License-Identifier: MIT */
#include "web/window.h"

#include <errno.h>

#include "harness/test.h"

TEST(window, has_a_session_and_its_cycles_in_any_order)
{
	struct window w;

	CHECK_EQ(window_parse("session=7&from=10&to=19", &w), 0);
	CHECK_EQ(w.session, 7);
	CHECK_EQ(w.from, 10);
	CHECK_EQ(w.to, 19);
	CHECK_EQ(window_parse("to=0&session=18446744073709551615&from=0", &w), 0);
	CHECK_EQ(w.session, UINT64_MAX);
	CHECK_EQ(w.to, 0);
}

TEST(window, what_is_no_such_query_is_refused_and_nothing_is_written)
{
	static const char *const queries[] = {
		"",
		"&",
		"session=7",
		"session=7&from=1",
		"session=7&from=1&to=",
		"session=7&from=1&to=2&",
		"session=7&from=1&to=2&to=2",
		"session=7&from=1&to=2&dir=/etc",
		"session=7&from=2&to=1",
		"session=0&from=1&to=2",
		"session=7&from=-1&to=2",
		"session=7&from=1&to=2x",
		"session=7&from= 1&to=2",
		"session=7&from=1&to=18446744073709551616",
		"session=7&from=1&to=000000000000000000000000000000000002",
		"session&from=1&to=2",
		"sessions=7&from=1&to=2",
		"SESSION=7&from=1&to=2",
		"session=7&from=1;to=2",
		"session=--dir&from=1&to=2",
	};
	struct window w = { 1, 2, 3 };

	for (size_t i = 0; i < sizeof(queries) / sizeof(queries[0]); i++) {
		CHECK_EQ(window_parse(queries[i], &w), -EINVAL);
	}
	CHECK_EQ(w.session, 1);
	CHECK_EQ(w.from, 2);
	CHECK_EQ(w.to, 3);
}

TEST(window, has_a_largest_size)
{
	struct window w;

	CHECK_EQ(window_parse("session=7&from=0&to=4194303", &w), 0);
	CHECK_EQ(window_parse("session=7&from=0&to=4194304", &w), -ERANGE);
	CHECK_EQ(window_parse("session=7&from=0&to=18446744073709551615", &w), -ERANGE);
}
