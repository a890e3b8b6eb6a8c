/* SPDX-License-Identifier: MIT */
#include "web/range.h"

#include <errno.h>

#include "harness/test.h"

enum { BYTES = 1000 };

static void check_part(const char *header, uint64_t first, uint64_t end)
{
	struct range range;

	CHECK_EQ(range_parse(header, BYTES, &range), 1);
	CHECK_EQ(range.first, first);
	CHECK_EQ(range.end, end);
}

TEST(range, a_part_is_what_was_asked_for_as_far_as_the_file_goes)
{
	check_part("bytes=0-0", 0, 1);
	check_part("bytes=0-999", 0, 1000);
	check_part("bytes=0-1000", 0, 1000);
	check_part("bytes=999-", 999, 1000);
	check_part("bytes=10-19", 10, 20);
	check_part("bytes=-1", 999, 1000);
	check_part("bytes=-1000", 0, 1000);
	check_part("bytes=-1001", 0, 1000);
	check_part("bytes=5-18446744073709551615", 5, 1000);
	check_part("bytes=5-99999999999999999999999", 5, 1000);
	check_part("bytes=-99999999999999999999999", 0, 1000);
}

TEST(range, a_header_that_cannot_be_read_is_ignored)
{
	static const char *const headers[] = {
		"",           "bytes",      "bytes=",        "bytes=-",       "bytes=a-b",
		"bytes=1",    "bytes=2-1",  "bytes=1-2,4-5", "items=1-2",     "bytes=1-2 ",
		"bytes= 1-2", "bytes=+1-2", "bytes=--1",     "bytes=0x1-0x2", "Bytes=1-2",
	};
	struct range range;

	for (size_t i = 0; i < sizeof(headers) / sizeof(headers[0]); i++) {
		CHECK_EQ(range_parse(headers[i], BYTES, &range), 0);
		CHECK_EQ(range.first, 0);
		CHECK_EQ(range.end, BYTES);
	}
}

TEST(range, nothing_of_it_in_the_file_is_an_error)
{
	struct range range;

	CHECK_EQ(range_parse("bytes=1000-", BYTES, &range), -ERANGE);
	CHECK_EQ(range_parse("bytes=99999999999999999999999-", BYTES, &range), -ERANGE);
	CHECK_EQ(range_parse("bytes=-0", BYTES, &range), -ERANGE);
	CHECK_EQ(range_parse("bytes=0-0", 0, &range), -ERANGE);
	CHECK_EQ(range_parse("bytes=-5", 0, &range), -ERANGE);
}
