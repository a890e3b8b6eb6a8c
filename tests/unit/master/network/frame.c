/* SPDX-License-Identifier: MIT */
#include "network/gateway_frame.h"

#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"

/* An SDO upload of 0x1018:01, as ETG.8200 has it: length 16, type 5; station 0x1003, counter 2. */
static const uint8_t upload[] = { 0x10, 0x50, 0x0a, 0x00, 0x03, 0x10, 0x00, 0x23, 0x00,
				  0x20, 0x40, 0x18, 0x10, 0x01, 0x00, 0x00, 0x00, 0x00 };

TEST(gateway_frame, a_whole_message_is_taken_apart)
{
	struct gateway_mail mail;

	CHECK_EQ(gateway_frame_get(upload, sizeof(upload), &mail), sizeof(upload));
	CHECK_EQ(mail.header.address, 0x1003);
	CHECK_EQ(mail.header.type, MAILBOX_TYPE_COE);
	CHECK_EQ(mail.header.counter, 2);
	CHECK_EQ(mail.header.data_len, 10);
	CHECK(mail.data == upload + 8);
}

TEST(gateway_frame, what_is_written_is_the_same_bytes)
{
	uint8_t bytes[GATEWAY_FRAME_BYTES];
	struct gateway_mail mail;

	CHECK(gateway_frame_get(upload, sizeof(upload), &mail) > 0);
	CHECK_EQ(gateway_frame_put(bytes, &mail), sizeof(upload));
	CHECK_MEM(bytes, upload, sizeof(upload));
}

TEST(gateway_frame, each_beginning_of_a_message_waits_for_the_rest)
{
	struct gateway_mail mail;

	for (size_t len = 0; len < sizeof(upload); len++) {
		CHECK_EQ(gateway_frame_get(upload, len, &mail), 0);
	}
}

TEST(gateway_frame, other_types_and_lengths_that_do_not_fit_are_rejected)
{
	uint8_t bytes[sizeof(upload)];
	struct gateway_mail mail = { .data = NULL };

	for (unsigned type = 0; type < 16; type++) {
		memcpy(bytes, upload, sizeof(bytes));
		bytes[1] = (uint8_t)(type << 4);
		CHECK_EQ(gateway_frame_get(bytes, sizeof(bytes), &mail),
			 type == 5 ? (int)sizeof(bytes) : -EBADMSG);
	}
	mail.data = NULL;
	memcpy(bytes, upload, sizeof(bytes));
	put_le16(bytes, 5 << 12 | 5); /* shorter than a mailbox header */
	CHECK_EQ(gateway_frame_get(bytes, sizeof(bytes), &mail), -EBADMSG);
	put_le16(bytes, 5 << 12 | (MAILBOX_BYTES + 1));
	CHECK_EQ(gateway_frame_get(bytes, sizeof(bytes), &mail), -EBADMSG);
	put_le16(bytes, 5 << 12 | 16);
	put_le16(bytes + 2, 11); /* longer than the frame */
	CHECK_EQ(gateway_frame_get(bytes, sizeof(bytes), &mail), -EBADMSG);
	CHECK(mail.data == NULL);
}

TEST(gateway_frame, the_longest_mail_fits)
{
	static uint8_t data[GATEWAY_DATA_BYTES];
	uint8_t bytes[GATEWAY_FRAME_BYTES];
	struct gateway_mail mail = { .header = { .data_len = sizeof(data), .type = 3 },
				     .data = data };
	struct gateway_mail read;

	CHECK_EQ(gateway_frame_put(bytes, &mail), sizeof(bytes));
	CHECK_EQ(gateway_frame_get(bytes, sizeof(bytes), &read), sizeof(bytes));
	CHECK_EQ(read.header.data_len, sizeof(data));
}
