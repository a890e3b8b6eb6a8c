/* SPDX-License-Identifier: MIT */
#include "cli/soe_value.h"

#include <errno.h>

#include "harness/test.h"
#include "wire/soe.h"

static uint32_t attribute(enum soe_length length, enum soe_format format, unsigned decimals)
{
	return (uint32_t)length << SOE_LENGTH_SHIFT | (uint32_t)format << SOE_FORMAT_SHIFT |
	       decimals << SOE_DECIMALS_SHIFT;
}

/* @text to bytes, and back. */
static void check_both_ways(uint32_t attr, const char *text, const char *shown)
{
	uint8_t bytes[SOE_LIST_HEADER_BYTES + 8 * 32];
	char back[SOE_ITEM_BYTES];

	CHECK_EQ(soe_value_parse(attr, text, bytes, sizeof(bytes)), (int)soe_value_bytes(attr));
	soe_item_format(attr, bytes, back);
	CHECK_STR(back, shown);
}

static void check_refused(uint32_t attr, const char *text, int error)
{
	uint8_t bytes[SOE_LIST_HEADER_BYTES + 8 * 40];

	CHECK_EQ(soe_value_parse(attr, text, bytes, sizeof(bytes)), error);
}

TEST(soe_value, a_number_is_shown_and_written_as_its_attribute_says)
{
	uint32_t cents = attribute(SOE_LENGTH_4, SOE_FORMAT_SIGNED, 2);

	check_both_ways(attribute(SOE_LENGTH_2, SOE_FORMAT_UNSIGNED, 0), "65535", "65535");
	check_both_ways(attribute(SOE_LENGTH_2, SOE_FORMAT_SIGNED, 0), "-32768", "-32768");
	check_both_ways(attribute(SOE_LENGTH_8, SOE_FORMAT_SIGNED, 0), "-1", "-1");
	check_both_ways(attribute(SOE_LENGTH_4, SOE_FORMAT_HEX, 0), "0x12", "0x00000012");
	check_both_ways(attribute(SOE_LENGTH_2, SOE_FORMAT_BINARY, 0), "258", "0x0102");
	check_both_ways(attribute(SOE_LENGTH_2, SOE_FORMAT_IDN, 0), "P-0-0002", "P-0-0002");
	check_both_ways(attribute(SOE_LENGTH_4, SOE_FORMAT_FLOAT, 0), "1.5", "1.5");
	check_both_ways(attribute(SOE_LENGTH_8, SOE_FORMAT_FLOAT, 0), "-0.5", "-0.5");
	check_both_ways(cents, "-12.34", "-12.34");
	check_both_ways(cents, "-0.05", "-0.05");
	check_both_ways(cents, "7", "7.00");
	check_both_ways(cents, "7.5", "7.50");
	check_both_ways(cents, "0x10", "0.16");
}

TEST(soe_value, what_does_not_fit_is_refused)
{
	uint32_t word = attribute(SOE_LENGTH_2, SOE_FORMAT_UNSIGNED, 0);
	uint32_t cents = attribute(SOE_LENGTH_4, SOE_FORMAT_SIGNED, 2);

	check_refused(word, "65536", -ERANGE);
	check_refused(word, "-1", -ERANGE);
	check_refused(word, "", -EINVAL);
	check_refused(word, "1,2", -EINVAL);
	check_refused(word, "1.0", -EINVAL);
	check_refused(cents, "1.234", -EINVAL);
	check_refused(cents, "1.2.3", -EINVAL);
	check_refused(cents, "99999999999999999999999999", -EINVAL);
	check_refused(cents, "21474836.48", -ERANGE);
	check_refused(attribute(0, SOE_FORMAT_UNSIGNED, 0), "1", -EINVAL);
}

TEST(soe_value, a_list_has_its_length_before_it)
{
	static const uint8_t words[] = { 6, 0, 6, 0, 1, 0, 2, 0, 3, 0 };
	static const uint8_t text[] = { 2, 0, 2, 0, 'a', ',' };
	uint32_t list = attribute(SOE_LENGTH_LIST_2, SOE_FORMAT_UNSIGNED, 0);
	uint8_t bytes[64];
	size_t len;

	CHECK_EQ(soe_value_parse(list, "1,2,3", bytes, sizeof(bytes)), sizeof(words));
	CHECK_MEM(bytes, words, sizeof(words));
	CHECK(soe_list_data(words, sizeof(words), &len) == words + SOE_LIST_HEADER_BYTES);
	CHECK_EQ(len, 6);
	soe_list_data(words, sizeof(words) - 1, &len); /* less than it says */
	CHECK_EQ(len, 5);
	soe_list_data(words, 3, &len);
	CHECK_EQ(len, 0);
	CHECK_EQ(soe_value_parse(list, "", bytes, sizeof(bytes)), SOE_LIST_HEADER_BYTES);
	check_refused(list, "1,", -EINVAL);
	check_refused(list, ",1", -EINVAL);
	check_refused(list, "1,65536", -ERANGE);
	list = attribute(SOE_LENGTH_LIST_1, SOE_FORMAT_TEXT, 0);
	CHECK(soe_is_text(list));
	CHECK_EQ(soe_value_parse(list, "a,", bytes, sizeof(bytes)), sizeof(text));
	CHECK_MEM(bytes, text, sizeof(text));
}

TEST(soe_value, an_attribute_is_described_in_words)
{
	char text[80];

	soe_attribute_format(attribute(SOE_LENGTH_LIST_4, SOE_FORMAT_HEX, 3), text, sizeof(text));
	CHECK_STR(text, "list of 4 bytes, hex");
	soe_attribute_format(attribute(SOE_LENGTH_2, SOE_FORMAT_SIGNED, 1) | SOE_IS_COMMAND, text,
			     sizeof(text));
	CHECK_STR(text, "2 bytes, signed, procedure command, 1 decimal place");
}
