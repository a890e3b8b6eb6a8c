/* SPDX-License-Identifier: MIT */
#include "wire/eoe.h"

#include <errno.h>

#include "harness/test.h"

enum { MAIL = 122 };

static uint8_t frame[EOE_FRAME_MAX_BYTES];

static void fill(void)
{
	for (size_t i = 0; i < sizeof(frame); i++) {
		frame[i] = (uint8_t)(i * 7 + i / 256);
	}
}

TEST(eoe, a_frame_of_every_length_is_the_same_after_split_and_assembly)
{
	static const size_t mails[] = { 36, 68, MAIL, 1018 };

	fill();
	for (size_t m = 0; m < sizeof(mails) / sizeof(mails[0]); m++) {
		for (size_t len = 1; len <= EOE_FRAME_MAX_BYTES; len++) {
			struct eoe_assembly a = { .len = 0 };
			struct eoe_split s = { .frame = frame, .len = len, .frame_number = 5 };
			uint8_t data[1018];
			size_t n;
			int r = 0;

			while ((n = eoe_split_next(&s, data, mails[m])) > 0) {
				CHECK_EQ(r, 0);
				CHECK(n <= mails[m]);
				r = eoe_assemble(&a, data, n);
			}
			CHECK_EQ(r, 1);
			CHECK_EQ(a.len, len);
			CHECK_MEM(a.frame, frame, len);
		}
	}
}

/* Fragments of a frame of 200 bytes. */
static size_t fragment(unsigned wanted, uint8_t *data)
{
	struct eoe_split s = { .frame = frame, .len = 200, .frame_number = 3 };
	size_t n = 0;

	for (unsigned i = 0; i <= wanted; i++) {
		n = eoe_split_next(&s, data, MAIL);
	}
	return n;
}

TEST(eoe, a_missing_or_doubled_fragment_drops_the_frame_and_the_next_one_is_whole)
{
	struct eoe_assembly a = { .len = 0 };
	uint8_t data[MAIL];

	fill();
	CHECK_EQ(eoe_assemble(&a, data, fragment(1, data)), -EBADMSG);
	CHECK_EQ(eoe_assemble(&a, data, fragment(0, data)), 0);
	CHECK_EQ(eoe_assemble(&a, data, fragment(2, data)), -EBADMSG);
	CHECK_EQ(eoe_assemble(&a, data, fragment(0, data)), 0);
	CHECK_EQ(eoe_assemble(&a, data, fragment(1, data)), 0);
	CHECK_EQ(eoe_assemble(&a, data, fragment(1, data)), -EBADMSG);
	for (unsigned i = 0; i < 3; i++) {
		CHECK_EQ(eoe_assemble(&a, data, fragment(i, data)), i == 2);
	}
	CHECK_EQ(a.len, 200);
}

TEST(eoe, what_does_not_follow_is_dropped)
{
	struct eoe_assembly a = { .len = 0 };
	uint8_t data[EOE_HEADER_BYTES + EOE_FRAME_MAX_BYTES + 8] = { 0 };

	CHECK_EQ(eoe_assemble(&a, data, 3), -EBADMSG);
	CHECK_EQ(eoe_assemble(&a, data, EOE_HEADER_BYTES), -EBADMSG);
	CHECK_EQ(eoe_assemble(&a, data, EOE_HEADER_BYTES + 33), -EBADMSG);
	data[0] = EOE_SET_IP;
	CHECK_EQ(eoe_assemble(&a, data, EOE_HEADER_BYTES + 32), -EBADMSG);
	data[0] = EOE_FRAGMENT;
	data[1] = 1;
	CHECK_EQ(eoe_assemble(&a, data, EOE_HEADER_BYTES + EOE_FRAME_MAX_BYTES + 1), -EBADMSG);
	CHECK_EQ(eoe_assemble(&a, data, EOE_HEADER_BYTES + EOE_FRAME_MAX_BYTES), 1);
	/* another frame's number in the middle */
	CHECK_EQ(eoe_assemble(&a, data, fragment(0, data)), 0);
	(void)fragment(1, data);
	data[3] ^= 0x10;
	CHECK_EQ(eoe_assemble(&a, data, MAIL), -EBADMSG);
}

TEST(eoe, a_time_stamp_behind_the_last_fragment_is_no_part_of_the_frame)
{
	struct eoe_assembly a = { .len = 0 };
	uint8_t data[EOE_HEADER_BYTES + 64] = { 0 };

	eoe_header_put(data, &(struct eoe_header){ .is_last = 1, .has_time = 1, .blocks = 2 });
	CHECK_EQ(eoe_assemble(&a, data, EOE_HEADER_BYTES + 64), 1);
	CHECK_EQ(a.len, 60);
	CHECK_EQ(eoe_assemble(&a, data, EOE_HEADER_BYTES + 3), -EBADMSG);
}

TEST(eoe, ip_parameters_come_back_and_short_ones_are_refused)
{
	const struct eoe_ip out = { .flags = 0x3f,
				    .mac = { 1, 2, 3, 4, 5, 6 },
				    .address = { 10, 0, 0, 9 },
				    .netmask = { 255, 0, 0, 0 },
				    .gateway = { 10, 0, 0, 1 },
				    .dns = { 10, 0, 0, 2 },
				    .name = "0123456789abcdef0123456789abcdef" };
	uint8_t data[EOE_IP_BYTES];
	struct eoe_ip in;

	eoe_ip_put(data, &out);
	CHECK_EQ(eoe_ip_get(data, sizeof(data), &in), 0);
	CHECK_EQ(memcmp(&in, &out, offsetof(struct eoe_ip, name)), 0);
	CHECK_STR(in.name, out.name);
	CHECK_EQ(data[10], 9); /* as a 32-bit number: the last byte first */
	CHECK_EQ(eoe_ip_get(data, 25, &in), -EBADMSG);
	CHECK_EQ(eoe_ip_get(data, 3, &in), -EBADMSG);
}
