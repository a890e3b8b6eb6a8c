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
