/* SPDX-License-Identifier: MIT */
#include "cli/hex.h"

#include <errno.h>

#include "harness/test.h"

TEST(hex, bytes_are_two_digits_each_with_or_without_blanks)
{
	static const uint8_t expected[] = { 0x0a, 0x1b, 0xff };
	static const char *const bad[] = { "0", "0a1", "0a 1", "0 a", "0x0a", "zz", "0a,1b", "-1" };
	uint8_t bytes[3];

	CHECK_EQ(hex_parse("0a1bff", bytes, sizeof(bytes)), 3);
	CHECK_MEM(bytes, expected, 3);
	CHECK_EQ(hex_parse(" 0A 1b  FF ", bytes, sizeof(bytes)), 3);
	CHECK_MEM(bytes, expected, 3);
	CHECK_EQ(hex_parse("", bytes, sizeof(bytes)), 0);
	CHECK_EQ(hex_parse("0a1bff00", bytes, sizeof(bytes)), -EINVAL);
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		CHECK_EQ(hex_parse(bad[i], bytes, sizeof(bytes)), -EINVAL);
	}
}
