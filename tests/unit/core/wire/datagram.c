/* SPDX-License-Identifier: MIT */
#include "wire/datagram.h"

#include "base/bytes.h"
#include "base/prng.h"
#include "harness/test.h"

enum { ETHERNET = ECAT_ETHERNET_BYTES, FIRST = ETHERNET + ECAT_FRAME_HEADER_BYTES };

static const uint8_t source[6] = { 1, 2, 3, 4, 5, 6 };

static size_t two_datagrams(uint8_t *frame)
{
	struct ecat_frame_builder fb;
	uint8_t *data;

	ecat_frame_begin(&fb, frame, source);
	data = ecat_frame_add(&fb, ECAT_CMD_FPRD, 7, 0x1001, 0x0130, 6);
	CHECK(data != NULL);
	data = ecat_frame_add(&fb, ECAT_CMD_LRW, 8, 0x2345, 0x0001, 40);
	CHECK(data != NULL);
	memset(data, 0xa5, 40);
	return ecat_frame_end(&fb);
}

TEST(datagram, what_is_built_is_walked)
{
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	size_t len = two_datagrams(frame);
	struct ecat_datagram dg;
	size_t pos = 0;

	CHECK_EQ(len, FIRST + 12 + 6 + 12 + 40);
	CHECK(ecat_frame_is_valid(frame, len));
	CHECK_MEM(frame + 6, source, 6);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), 1);
	CHECK_EQ(dg.cmd, ECAT_CMD_FPRD);
	CHECK_EQ(dg.idx, 7);
	CHECK_EQ(dg.adp, 0x1001);
	CHECK_EQ(dg.ado, 0x0130);
	CHECK_EQ(dg.data_len, 6);
	CHECK_EQ(get_le16(dg.wkc), 0);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), 1);
	CHECK_EQ(ecat_logical_address(&dg), 0x00012345);
	CHECK_EQ(dg.data[39], 0xa5);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), 0);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), 0);
}

TEST(datagram, a_short_frame_is_padded_with_zeros)
{
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	struct ecat_frame_builder fb;

	memset(frame, 0xff, sizeof(frame));
	ecat_frame_begin(&fb, frame, source);
	CHECK(ecat_frame_add(&fb, ECAT_CMD_NOP, 0, 0, 0, 0) != NULL);
	CHECK_EQ(ecat_frame_end(&fb), ECAT_FRAME_MIN_BYTES);
	for (size_t i = FIRST + 12; i < ECAT_FRAME_MIN_BYTES; i++) {
		CHECK_EQ(frame[i], 0);
	}
}

TEST(datagram, what_does_not_fit_is_refused_and_the_frame_stays_whole)
{
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	struct ecat_frame_builder fb;
	struct ecat_datagram dg;
	size_t pos = 0;
	size_t len;

	ecat_frame_begin(&fb, frame, source);
	CHECK(ecat_frame_add(&fb, ECAT_CMD_LRW, 0, 0, 0, ECAT_DATAGRAM_MAX_BYTES + 1) == NULL);
	CHECK(ecat_frame_add(&fb, ECAT_CMD_LRW, 0, 0, 0, ECAT_DATAGRAM_MAX_BYTES) != NULL);
	CHECK(ecat_frame_add(&fb, ECAT_CMD_NOP, 0, 0, 0, 0) == NULL);
	len = ecat_frame_end(&fb);
	CHECK_EQ(len, ECAT_FRAME_MAX_BYTES);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), 1);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), 0);
}

TEST(datagram, other_ethertypes_and_other_ethercat_types_are_not_ours)
{
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	size_t len = two_datagrams(frame);

	for (size_t cut = 0; cut < len; cut++) {
		CHECK_EQ(ecat_frame_is_valid(frame, cut), 0);
	}
	frame[12] = 0x08;
	CHECK_EQ(ecat_frame_is_valid(frame, len), 0);
	len = two_datagrams(frame);
	put_le16(frame + ETHERNET, (uint16_t)(get_le16(frame + ETHERNET) & 0x0fff) | 4 << 12);
	CHECK_EQ(ecat_frame_is_valid(frame, len), 0);
}

TEST(datagram, a_length_past_the_end_or_a_missing_next_datagram_is_damage)
{
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	size_t len = two_datagrams(frame);
	struct ecat_datagram dg;
	size_t pos = 0;

	put_le16(frame + FIRST + 18 + 6, 41);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), 1);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), -1);
	pos = 0;
	put_le16(frame + FIRST + 18 + 6, 40 | 0x8000);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), 1);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), 1);
	CHECK_EQ(ecat_frame_next(frame, len, &pos, &dg), -1);
}

TEST(datagram, garbage_is_walked_within_its_bounds_and_to_an_end)
{
	struct prng prng = { 2026 };

	for (int round = 0; round < 20000; round++) {
		size_t len = (size_t)prng_below(&prng, 200);
		uint8_t *frame = malloc(len + 1); /* of its own size, for the sanitizer */
		struct ecat_datagram dg;
		size_t pos = 0;
		int steps = 0;

		CHECK(frame != NULL);
		for (size_t i = 0; i < len; i++) {
			frame[i] = (uint8_t)prng_next(&prng);
		}
		if (len > FIRST && round % 2 == 0) {
			put_le16(frame + ETHERNET, (uint16_t)((len - FIRST) | 1 << 12));
		}
		while (ecat_frame_next(frame, len, &pos, &dg) == 1) {
			CHECK(dg.data >= frame && dg.wkc + 2 <= frame + len);
			CHECK_EQ(dg.wkc - dg.data, dg.data_len);
			CHECK(++steps < 20);
		}
		free(frame);
	}
}

TEST(datagram, every_command_has_its_name)
{
	CHECK_STR(ecat_cmd_to_str(ECAT_CMD_NOP), "NOP");
	CHECK_STR(ecat_cmd_to_str(ECAT_CMD_BRW), "BRW");
	CHECK_STR(ecat_cmd_to_str(ECAT_CMD_FRMW), "FRMW");
	CHECK_STR(ecat_cmd_to_str(15), "?");
	CHECK_STR(ecat_cmd_to_str(255), "?");
}
