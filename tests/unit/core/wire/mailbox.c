/* SPDX-License-Identifier: MIT */
#include "wire/mailbox.h"

#include "harness/test.h"

TEST(mailbox_header, every_field_comes_back_and_the_reserved_bits_are_zero)
{
	const struct mailbox_header out = { .data_len = 0x1234,
					    .address = 0x1001,
					    .priority = 3,
					    .type = MAILBOX_TYPE_VOE,
					    .counter = 7 };
	const uint8_t bytes[MAILBOX_HEADER_BYTES] = { 0x34, 0x12, 0x01, 0x10, 0xc0, 0x7f };
	uint8_t p[MAILBOX_HEADER_BYTES];
	struct mailbox_header in;

	mailbox_header_put(p, &out);
	CHECK_MEM(p, bytes, sizeof(bytes));
	p[5] |= 0x80; /* reserved: ignored */
	in = mailbox_header_get(p);
	CHECK_EQ(in.data_len, out.data_len);
	CHECK_EQ(in.address, out.address);
	CHECK_EQ(in.priority, out.priority);
	CHECK_EQ(in.type, out.type);
	CHECK_EQ(in.counter, out.counter);
}

TEST(mailbox_header, counters_run_from_1_to_7_and_never_become_0)
{
	uint8_t counter = 0;

	for (unsigned i = 0; i < 21; i++) {
		counter = mailbox_counter_next(counter);
		CHECK_EQ(counter, i % 7 + 1);
	}
}

TEST(mailbox_header, an_error_reply_has_its_detail_and_nothing_else_has_one)
{
	uint8_t data[MAILBOX_ERROR_BYTES];

	mailbox_error_put(data, MAILBOX_ERROR_INVALID_SIZE);
	CHECK_EQ(mailbox_error_get(data, sizeof(data)), MAILBOX_ERROR_INVALID_SIZE);
	CHECK_EQ(mailbox_error_get(data, 3), 0);
	data[0] = 2;
	CHECK_EQ(mailbox_error_get(data, sizeof(data)), 0);
}

TEST(mailbox_header, protocols_and_errors_have_names_and_others_are_unknown)
{
	CHECK_STR(mailbox_type_to_str(MAILBOX_TYPE_FOE), "FoE");
	CHECK_STR(mailbox_type_to_str(MAILBOX_TYPE_VOE), "VoE");
	CHECK_STR(mailbox_type_to_str(9), "unknown");
	CHECK_STR(mailbox_type_to_str(16), "unknown");
	CHECK_STR(mailbox_error_to_str(MAILBOX_ERROR_UNSUPPORTED_PROTOCOL),
		  "protocol not supported");
	CHECK_STR(mailbox_error_to_str(0), "unknown");
	CHECK_STR(mailbox_error_to_str(10), "unknown");
}
