/* SPDX-License-Identifier: MIT */
#include "wire/echo.h"

#include <string.h>

#include "base/bytes.h"
#include "wire/datagram.h"

enum {
	HEADERS = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES,
	LENGTH_MASK = 0x07ff,
	MORE_FOLLOWS = 0x8000,
	SOURCE_OCTET = 6,
	PASSED_A_SLAVE = 0x02,
};

/* Broadcast and auto-increment commands: every slave adds one to the address. */
static int is_position_counted(uint8_t cmd)
{
	return (cmd >= ECAT_CMD_APRD && cmd <= ECAT_CMD_APRW) ||
	       (cmd >= ECAT_CMD_BRD && cmd <= ECAT_CMD_BRW) || cmd == ECAT_CMD_ARMW;
}

/* Of the first eight octets of a datagram: command, index, address, length of the data. */
#define INDEX_BITS UINT64_C(0xff00)
#define POSITION_BITS UINT64_C(0xffff0000)

/* The bits of those that slaves leave alone. */
static uint64_t kept_bits(uint8_t cmd, enum echo_index index)
{
	uint64_t kept = UINT64_MAX >> 16 | (uint64_t)(LENGTH_MASK | MORE_FOLLOWS) << 48;

	if (index == ECHO_INDEX_ANY) {
		kept &= ~INDEX_BITS;
	}
	return is_position_counted(cmd) ? kept & ~POSITION_BITS : kept;
}

static int is_same_datagram(const uint8_t *sent, const uint8_t *got, enum echo_index index)
{
	return ((get_le64(sent) ^ get_le64(got)) & kept_bits(sent[0], index)) == 0;
}

int echo_matches(const uint8_t *sent, const uint8_t *frame, size_t frame_len, enum echo_index index)
{
	size_t end = HEADERS + (size_t)(get_le16(sent + ECAT_ETHERNET_BYTES) & LENGTH_MASK);
	size_t pos = HEADERS;

	if (!ecat_frame_is_valid(frame, frame_len) || frame_len < end ||
	    get_le16(frame + ECAT_ETHERNET_BYTES) != get_le16(sent + ECAT_ETHERNET_BYTES)) {
		return 0;
	}
	/* What never passed a slave is our own frame, mirrored. */
	if ((frame[SOURCE_OCTET] & PASSED_A_SLAVE) == 0) {
		return 0;
	}
	while (pos + ECAT_DATAGRAM_HEADER_BYTES + ECAT_WKC_BYTES <= end) {
		uint16_t length_word = get_le16(sent + pos + 6);

		if (!is_same_datagram(sent + pos, frame + pos, index)) {
			return 0;
		}
		if ((length_word & MORE_FOLLOWS) == 0) {
			return 1;
		}
		pos += ECAT_DATAGRAM_HEADER_BYTES + (size_t)(length_word & LENGTH_MASK) +
		       ECAT_WKC_BYTES;
	}
	return 0;
}

int echo_is_unchanged(const uint8_t *sent, size_t sent_len, const uint8_t *frame, size_t frame_len)
{
	return frame_len >= sent_len && memcmp(sent, frame, sent_len) == 0;
}
