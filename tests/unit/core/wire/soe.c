/* SPDX-License-Identifier: MIT */
#include "wire/soe.h"

#include <errno.h>

#include "harness/test.h"

TEST(soe, a_message_comes_back_as_it_was_written)
{
	static const uint8_t body[] = { 1, 2, 3 };
	uint8_t data[16];
	struct soe_message in;

	for (uint8_t op = SOE_READ; op <= SOE_EMERGENCY; op++) {
		for (uint8_t more = 0; more < 2; more++) {
			const struct soe_message out = { .operation = op,
							 .drive = 7,
							 .is_error = more,
							 .has_more = more,
							 .elements = 0x41,
							 .idn = more ? 0 : 0x8001,
							 .fragments_left = more ? 513 : 0,
							 .body = body,
							 .body_len = 3 };
			size_t len = soe_format(&out, data, sizeof(data));

			CHECK_EQ(len, SOE_HEADER_BYTES + 3);
			CHECK_EQ(soe_parse(data, len, &in), 0);
			CHECK_EQ(in.operation, op);
			CHECK_EQ(in.drive, 7);
			CHECK_EQ(in.is_error, more);
			CHECK_EQ(in.has_more, more);
			CHECK_EQ(in.elements, 0x41);
			CHECK_EQ(in.idn, out.idn);
			CHECK_EQ(in.fragments_left, out.fragments_left);
			CHECK_EQ(in.body_len, 3);
			CHECK_MEM(in.body, body, 3);
		}
	}
	CHECK_EQ(soe_format(&in, data, 6), 0);
}

TEST(soe, a_short_or_unknown_message_is_refused_and_the_output_untouched)
{
	uint8_t data[8] = { SOE_READ };
	struct soe_message m = { .idn = 99 };

	CHECK_EQ(soe_parse(data, 3, &m), -EBADMSG);
	data[0] = 0;
	CHECK_EQ(soe_parse(data, 8, &m), -EBADMSG);
	data[0] = 7;
	CHECK_EQ(soe_parse(data, 8, &m), -EBADMSG);
	data[0] = SOE_READ_RESPONSE | 0x10;
	CHECK_EQ(soe_parse(data, 5, &m), -EBADMSG);
	CHECK_EQ(m.idn, 99);
	CHECK_EQ(soe_parse(data, 6, &m), 0);
}

TEST(soe, attributes_say_how_long_a_value_is)
{
	CHECK_EQ(soe_value_bytes(SOE_LENGTH_2 << SOE_LENGTH_SHIFT), 2);
	CHECK_EQ(soe_value_bytes(SOE_LENGTH_8 << SOE_LENGTH_SHIFT), 8);
	CHECK_EQ(soe_value_bytes(SOE_LENGTH_LIST_1 << SOE_LENGTH_SHIFT), 1);
	CHECK_EQ(soe_value_bytes(0), 0);
	CHECK_EQ(soe_is_list(SOE_LENGTH_8 << SOE_LENGTH_SHIFT), 0);
	CHECK_EQ(soe_is_list(SOE_LENGTH_LIST_1 << SOE_LENGTH_SHIFT), 1);
	CHECK_STR(soe_error_to_str(SOE_ERROR_NO_IDN), "no such IDN");
	CHECK_STR(soe_error_to_str(0x6666), "unknown error");
}

TEST(soe, an_idn_is_a_kind_a_set_and_a_number)
{
	static const struct {
		const char *text;
		uint16_t idn;
	} good[] = { { "S-0-0000", 0 },      { "S-0-0017", 17 },     { "p-0-0001", 0x8001 },
		     { "S-7-4095", 0x7fff }, { "P-7-4095", 0xffff }, { "S-1-5", 0x1005 } };
	static const char *const bad[] = {
		"",         "S",       "S-",      "S-0",    "S-0-",  "S-8-0",
		"S-0-4096", "S-0-1x",  "S-0-0x1", "X-0-1",  "65536", "-1",
		"1x",       "0x10000", "S--1",    "S-0--1", "0x",    "99999999999999999999"
	};
	char text[SOE_IDN_TEXT_BYTES];
	uint16_t idn = 7;

	for (size_t i = 0; i < sizeof(good) / sizeof(good[0]); i++) {
		CHECK_EQ(soe_idn_parse(good[i].text, &idn), 0);
		CHECK_EQ(idn, good[i].idn);
	}
	CHECK_EQ(soe_idn_parse("65535", &idn), 0);
	CHECK_EQ(idn, 65535);
	CHECK_EQ(soe_idn_parse("0x8001", &idn), 0);
	CHECK_EQ(idn, 0x8001);
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		CHECK_EQ(soe_idn_parse(bad[i], &idn), -EINVAL);
		CHECK_EQ(idn, 0x8001);
	}
	for (uint32_t n = 0; n <= UINT16_MAX; n++) {
		soe_idn_format((uint16_t)n, text);
		CHECK_EQ(soe_idn_parse(text, &idn), 0);
		CHECK_EQ(idn, n);
	}
	CHECK_STR(text, "P-7-4095");
}
