/* SPDX-License-Identifier: MIT */
#include "wire/datagram.h"

#include <assert.h>
#include <string.h>

#include "base/bytes.h"

enum {
	DATAGRAMS_OFFSET = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES,
	LENGTH_MASK = 0x07ff,
	MORE_FOLLOWS = 0x8000,
	FRAME_TYPE_DATAGRAMS = 1,
};

void ecat_frame_begin(struct ecat_frame_builder *fb, uint8_t *buf, const uint8_t *source)
{
	memset(buf, 0xff, 6);
	memcpy(buf + 6, source, 6);
	buf[12] = ECAT_ETHERTYPE >> 8;
	buf[13] = ECAT_ETHERTYPE & 0xff;
	fb->buf = buf;
	fb->len = DATAGRAMS_OFFSET;
	fb->last_header = NULL;
}

uint8_t *ecat_frame_add(struct ecat_frame_builder *fb, enum ecat_cmd cmd, uint8_t idx, uint16_t adp,
			uint16_t ado, uint16_t data_len)
{
	uint8_t *p = fb->buf + fb->len;
	size_t total = ECAT_DATAGRAM_HEADER_BYTES + (size_t)data_len + ECAT_WKC_BYTES;

	if (data_len > ECAT_DATAGRAM_MAX_BYTES || fb->len + total > ECAT_FRAME_MAX_BYTES) {
		return NULL;
	}
	if (fb->last_header != NULL) {
		put_le16(fb->last_header + 6, get_le16(fb->last_header + 6) | MORE_FOLLOWS);
	}
	memset(p, 0, total);
	p[0] = (uint8_t)cmd;
	p[1] = idx;
	put_le16(p + 2, adp);
	put_le16(p + 4, ado);
	put_le16(p + 6, data_len);
	fb->last_header = p;
	fb->len += total;
	return p + ECAT_DATAGRAM_HEADER_BYTES;
}

size_t ecat_frame_end(struct ecat_frame_builder *fb)
{
	size_t datagrams = fb->len - DATAGRAMS_OFFSET;

	assert(fb->last_header != NULL);
	put_le16(fb->buf + ECAT_ETHERNET_BYTES, (uint16_t)(datagrams | FRAME_TYPE_DATAGRAMS << 12));
	if (fb->len < ECAT_FRAME_MIN_BYTES) {
		memset(fb->buf + fb->len, 0, ECAT_FRAME_MIN_BYTES - fb->len);
		fb->len = ECAT_FRAME_MIN_BYTES;
	}
	return fb->len;
}

int ecat_frame_is_valid(const uint8_t *frame, size_t frame_len)
{
	uint16_t header;

	if (frame_len < DATAGRAMS_OFFSET || frame[12] != ECAT_ETHERTYPE >> 8 ||
	    frame[13] != (ECAT_ETHERTYPE & 0xff)) {
		return 0;
	}
	header = get_le16(frame + ECAT_ETHERNET_BYTES);
	return header >> 12 == FRAME_TYPE_DATAGRAMS &&
	       DATAGRAMS_OFFSET + (size_t)(header & LENGTH_MASK) <= frame_len;
}

int ecat_frame_next(uint8_t *frame, size_t frame_len, size_t *pos, struct ecat_datagram *ret)
{
	size_t end;
	uint16_t length_word;
	uint8_t *p;

	if (frame_len < DATAGRAMS_OFFSET) {
		return -1;
	}
	end = DATAGRAMS_OFFSET + (size_t)(get_le16(frame + ECAT_ETHERNET_BYTES) & LENGTH_MASK);
	if (end > frame_len) {
		return -1;
	}
	if (*pos == 0) {
		*pos = DATAGRAMS_OFFSET;
	} else if (*pos == SIZE_MAX) {
		return 0;
	}
	p = frame + *pos;
	if (*pos + ECAT_DATAGRAM_HEADER_BYTES + ECAT_WKC_BYTES > end) {
		return -1;
	}
	length_word = get_le16(p + 6);
	ret->cmd = p[0];
	ret->idx = p[1];
	ret->adp = get_le16(p + 2);
	ret->ado = get_le16(p + 4);
	ret->data_len = length_word & LENGTH_MASK;
	ret->irq = get_le16(p + 8);
	ret->data = p + ECAT_DATAGRAM_HEADER_BYTES;
	ret->wkc = ret->data + ret->data_len;
	if (*pos + ECAT_DATAGRAM_HEADER_BYTES + ret->data_len + ECAT_WKC_BYTES > end) {
		return -1;
	}
	if (length_word & MORE_FOLLOWS) {
		*pos += ECAT_DATAGRAM_HEADER_BYTES + (size_t)ret->data_len + ECAT_WKC_BYTES;
	} else {
		*pos = SIZE_MAX;
	}
	return 1;
}

const char *ecat_cmd_to_str(uint8_t cmd)
{
	static const char *const names[] = { "NOP",  "APRD", "APWR", "APRW", "FPRD",
					     "FPWR", "FPRW", "BRD",  "BWR",  "BRW",
					     "LRD",  "LWR",  "LRW",  "ARMW", "FRMW" };

	return cmd < sizeof(names) / sizeof(names[0]) ? names[cmd] : "?";
}
