/* SPDX-License-Identifier: MIT */
#include "wire/echo.h"

#include "base/bytes.h"
#include "harness/test.h"
#include "wire/datagram.h"

enum { SOURCE_OCTET = 6, PASSED_A_SLAVE = 0x02, DATAGRAM = 16, IRQ = 8 };

struct pair {
	uint8_t sent[ECAT_FRAME_MAX_BYTES];
	uint8_t back[ECAT_FRAME_MAX_BYTES];
	size_t len;
};

static const uint8_t source[6] = { 0x10, 1, 1, 1, 1, 1 };

/* A broadcast read and a configured write, and the same as the slaves return them. */
static struct pair make_pair(void)
{
	struct pair p = { .len = 0 };
	struct ecat_frame_builder fb;

	ecat_frame_begin(&fb, p.sent, source);
	ecat_frame_add(&fb, ECAT_CMD_BRD, 7, 0, 0x0130, 2);
	ecat_frame_add(&fb, ECAT_CMD_FPWR, 8, 0x1001, 0x0120, 40);
	p.len = ecat_frame_end(&fb);
	memcpy(p.back, p.sent, p.len);
	p.back[SOURCE_OCTET] |= PASSED_A_SLAVE;
	return p;
}

static int matches(const struct pair *p, size_t back_len)
{
	return echo_matches(p->sent, p->back, back_len, ECHO_INDEX_SAME);
}

TEST(echo, what_slaves_change_does_not_count)
{
	struct pair p = make_pair();

	CHECK_EQ(matches(&p, p.len), 1);
	put_le16(p.back + DATAGRAM + 2, 3);        /* position of a broadcast */
	put_le16(p.back + DATAGRAM + IRQ, 0x0204); /* event request */
	put_le16(p.back + DATAGRAM + 10, 0x0008);  /* data */
	put_le16(p.back + DATAGRAM + 12, 3);       /* WKC */
	p.back[DATAGRAM + 7] |= 0x40;              /* circulating bit */
	CHECK_EQ(matches(&p, p.len), 1);
}

TEST(echo, a_frame_that_passed_no_slave_is_not_an_answer)
{
	struct pair p = make_pair();

	p.back[SOURCE_OCTET] = source[0];
	CHECK_EQ(matches(&p, p.len), 0);
}

TEST(echo, command_register_length_and_station_address_count)
{
	static const struct {
		size_t at;
		uint8_t flip;
	} change[] = {
		{ DATAGRAM, 0x02 },      /* command */
		{ DATAGRAM + 4, 0x01 },  /* register */
		{ DATAGRAM + 14, 0x01 }, /* second datagram: command */
		{ DATAGRAM + 16, 0x01 }, /* station address */
		{ DATAGRAM + 7, 0x80 },  /* another datagram follows */
		{ DATAGRAM + 20, 0x01 }, /* data length */
	};

	for (size_t i = 0; i < sizeof(change) / sizeof(change[0]); i++) {
		struct pair p = make_pair();

		p.back[change[i].at] ^= change[i].flip;
		CHECK_EQ(matches(&p, p.len), 0);
	}
}

/* Bit @bit of the header's first eight octets is one that an answer has as it was sent. */
static int is_kept(uint8_t cmd, unsigned bit, enum echo_index index)
{
	int is_counted = cmd == ECAT_CMD_BRD || cmd == ECAT_CMD_ARMW || cmd == ECAT_CMD_APRW;

	if (bit / 8 == 1) {
		return index == ECHO_INDEX_SAME;
	}
	if (bit / 16 == 1) {
		return !is_counted;
	}
	return bit < 6 * 8 + 11 || bit == 63;
}

TEST(echo, each_bit_of_a_header_counts_or_is_the_slaves_to_change)
{
	static const enum ecat_cmd commands[] = { ECAT_CMD_BRD,  ECAT_CMD_APRW, ECAT_CMD_ARMW,
						  ECAT_CMD_FPRD, ECAT_CMD_LRW,  ECAT_CMD_FRMW };

	for (unsigned c = 0; c < sizeof(commands) / sizeof(commands[0]); c++) {
		for (unsigned bit = 0; bit < 64; bit++) {
			struct pair p = make_pair();

			p.sent[DATAGRAM] = (uint8_t)commands[c];
			p.back[DATAGRAM] = (uint8_t)commands[c];
			p.back[DATAGRAM + bit / 8] ^= (uint8_t)(1u << bit % 8);
			CHECK_EQ(echo_matches(p.sent, p.back, p.len, ECHO_INDEX_SAME),
				 !is_kept(p.sent[DATAGRAM], bit, ECHO_INDEX_SAME));
			CHECK_EQ(echo_matches(p.sent, p.back, p.len, ECHO_INDEX_ANY),
				 !is_kept(p.sent[DATAGRAM], bit, ECHO_INDEX_ANY));
		}
	}
}

TEST(echo, index_counts_unless_any_is_accepted)
{
	struct pair p = make_pair();

	p.back[DATAGRAM + 1]++;
	CHECK_EQ(matches(&p, p.len), 0);
	CHECK_EQ(echo_matches(p.sent, p.back, p.len, ECHO_INDEX_ANY), 1);
}

/* The bytes behind a short frame are another frame's: they must not be compared. */
TEST(echo, a_truncated_frame_is_not_an_answer)
{
	struct pair p = make_pair();
	size_t end = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES + 14 + 52;

	CHECK(end <= p.len);
	for (size_t len = 0; len < end; len++) {
		CHECK_EQ(matches(&p, len), 0);
	}
	CHECK_EQ(matches(&p, end), 1);
}

/* Valid by itself, and shorter than what was sent. */
TEST(echo, a_valid_frame_that_is_shorter_than_the_sent_one_is_not_an_answer)
{
	struct pair p = make_pair();
	struct ecat_frame_builder fb;
	size_t len;

	ecat_frame_begin(&fb, p.back, source);
	ecat_frame_add(&fb, ECAT_CMD_BRD, 7, 0, 0x0130, 2);
	len = ecat_frame_end(&fb);
	p.back[SOURCE_OCTET] |= PASSED_A_SLAVE;
	CHECK_EQ(ecat_frame_is_valid(p.back, len), 1);
	CHECK_EQ(matches(&p, len), 0);
}

/* As long as the sent one, and not EtherCAT. */
TEST(echo, a_frame_of_another_type_is_not_an_answer)
{
	struct pair p = make_pair();

	p.back[12] = 0x08;
	p.back[13] = 0x00;
	CHECK_EQ(matches(&p, p.len), 0);
}
