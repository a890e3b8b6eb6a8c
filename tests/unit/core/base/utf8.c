/* SPDX-License-Identifier: MIT */
#include "base/utf8.h"

#include "harness/test.h"

TEST(utf8, what_is_no_utf8_is_replaced_byte_by_byte)
{
	char buf[32];

	utf8_copy("\xc2\xb5 and \xe2\x82\xac", buf, sizeof(buf));
	CHECK_STR(buf, "\xc2\xb5 and \xe2\x82\xac");
	utf8_copy("Piccolo \xb5", buf, sizeof(buf));
	CHECK_STR(buf, "Piccolo " UTF8_REPLACEMENT);
	utf8_copy("\xc0\x80\xed\xa0\x80", buf, sizeof(buf));
	CHECK_STR(buf, UTF8_REPLACEMENT UTF8_REPLACEMENT UTF8_REPLACEMENT UTF8_REPLACEMENT
			       UTF8_REPLACEMENT);
	utf8_copy("\xe2\x82", buf, sizeof(buf));
	CHECK_STR(buf, UTF8_REPLACEMENT UTF8_REPLACEMENT);
}

TEST(utf8, a_text_that_is_too_long_is_cut_between_characters)
{
	char buf[5];

	utf8_copy("abc\xc2\xb5", buf, sizeof(buf));
	CHECK_STR(buf, "abc");
	utf8_copy("abcdef", buf, sizeof(buf));
	CHECK_STR(buf, "abcd");
	utf8_copy("\xb5\xb5", buf, sizeof(buf));
	CHECK_STR(buf, UTF8_REPLACEMENT);
	utf8_copy("", buf, 1);
	CHECK_STR(buf, "");
}
