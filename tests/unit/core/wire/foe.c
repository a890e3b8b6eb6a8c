/* SPDX-License-Identifier: MIT */
#include "wire/foe.h"

#include <errno.h>

#include "harness/test.h"

TEST(foe, each_operation_comes_back_as_it_was_written)
{
	static const uint8_t text[] = "firmware.bin";

	for (uint8_t op = FOE_READ; op <= FOE_BUSY; op++) {
		const struct foe_message out = { .operation = op,
						 .number = op == FOE_BUSY ? 0 : 0x12345678,
						 .busy_done = op == FOE_BUSY ? 7 : 0,
						 .busy_all = op == FOE_BUSY ? 9 : 0,
						 .body = op == FOE_ACK ? NULL : text,
						 .body_len = op == FOE_ACK ? 0 : 12 };
		uint8_t data[32];
		struct foe_message in;
		size_t len = foe_format(&out, data, sizeof(data));

		CHECK_EQ(len, FOE_HEADER_BYTES + out.body_len);
		CHECK_EQ(foe_parse(data, len, &in), 0);
		CHECK_EQ(in.operation, op);
		CHECK_EQ(in.number, out.number);
		CHECK_EQ(in.busy_done, out.busy_done);
		CHECK_EQ(in.busy_all, out.busy_all);
		CHECK_EQ(in.body_len, out.body_len);
		if (in.body_len > 0) {
			CHECK_MEM(in.body, text, in.body_len);
		}
	}
}

TEST(foe, a_short_or_unknown_message_is_refused_and_the_output_untouched)
{
	uint8_t data[8] = { FOE_DATA };
	struct foe_message m = { .operation = 99 };

	CHECK_EQ(foe_parse(data, FOE_HEADER_BYTES - 1, &m), -EBADMSG);
	CHECK_EQ(foe_parse(data, 0, &m), -EBADMSG);
	data[0] = 0;
	CHECK_EQ(foe_parse(data, sizeof(data), &m), -EBADMSG);
	data[0] = FOE_BUSY + 1;
	CHECK_EQ(foe_parse(data, sizeof(data), &m), -EBADMSG);
	CHECK_EQ(m.operation, 99);
}

TEST(foe, what_does_not_fit_is_not_written)
{
	static const uint8_t text[] = "0123456789";
	uint8_t data[16] = { 0 };
	const struct foe_message m = { .operation = FOE_DATA, .body = text, .body_len = 10 };

	CHECK_EQ(foe_format(&m, data, 15), 0);
	CHECK_EQ(foe_format(&m, data, 5), 0);
	CHECK_EQ(data[0], 0);
	CHECK_EQ(foe_format(&m, data, 16), 16);
}

TEST(foe, error_codes_have_their_text)
{
	CHECK_STR(foe_error_to_str(FOE_ERROR_NOT_FOUND), "file not found");
	CHECK_STR(foe_error_to_str(FOE_ERROR_FLASH), "flash error");
	CHECK_STR(foe_error_to_str(0), "unknown error");
	CHECK_STR(foe_error_to_str(0x800e), "unknown error");
}
