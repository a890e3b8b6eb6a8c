/* SPDX-License-Identifier: MIT */
/*
 * Frames from anywhere into a simulated segment: a terminal with firmware and one without. The
 * input is a list of frames, each behind its length (2 bytes) and the time since the one before (2
 * bytes, in 10 us). Half of what a frame needs is put right, so that the search comes past its
 * header.
 */
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "devices/sii_device.h"
#include "segment/segment.h"
#include "wire/datagram.h"
#include "wire/sii.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { SII_BYTES = 256, LOADED_NS = 10000000, HEAD_BYTES = 4, TIME_UNIT_NS = 10000 };

static size_t put_category(uint8_t *sii, size_t at, uint16_t type, const uint8_t *body,
			   size_t bytes)
{
	put_le16(sii + at, type);
	put_le16(sii + at + 2, (uint16_t)(bytes / 2));
	memcpy(sii + at + 4, body, bytes);
	return at + 4 + bytes;
}

/* Mailboxes at 0x1000 and 0x1080, outputs of one byte at 0x1100, inputs of one at 0x1180, CoE. */
static void make_sii(uint8_t *sii, uint8_t config)
{
	static const uint8_t sms[] = {
		0x00, 0x10, 0x80, 0, 0x26, 0, 1, 1, 0x80, 0x10, 0x80, 0, 0x22, 0, 1, 2,
		0x00, 0x11, 0x01, 0, 0x64, 0, 1, 3, 0x80, 0x11, 0x01, 0, 0x20, 0, 1, 4,
	};
	static const uint8_t tx[] = { 0, 0x1a, 1, 3, 0, 0, 0, 0, 0, 0x60, 1, 0, 5, 8, 0, 0 };
	static const uint8_t rx[] = { 0, 0x16, 1, 2, 0, 0, 0, 0, 0, 0x70, 1, 0, 5, 8, 0, 0 };
	size_t at = SII_CATEGORIES_BYTE;

	memset(sii, 0, SII_BYTES);
	sii[0] = 5;
	sii[1] = (uint8_t)(0x0c | config);
	put_le16(sii + 4, 100);
	sii[14] = sii_checksum(sii);
	put_le16(sii + 0x38, SII_MAILBOX_COE);
	at = put_category(sii, at, SII_CATEGORY_SM, sms, sizeof(sms));
	at = put_category(sii, at, SII_CATEGORY_TXPDO, tx, sizeof(tx));
	at = put_category(sii, at, SII_CATEGORY_RXPDO, rx, sizeof(rx));
	put_le16(sii + at, SII_CATEGORY_END);
}

static struct segment *make_segment(void)
{
	static uint8_t sii[2][SII_BYTES];
	struct segment_slave_spec spec[2];
	struct segment *segment = NULL;

	memset(spec, 0, sizeof(spec));
	for (int i = 0; i < 2; i++) {
		make_sii(sii[i], (uint8_t)i);
		spec[i] =
			(struct segment_slave_spec){ .features = &esc_et1100,
						     .sii = sii[i],
						     .sii_bytes = SII_BYTES,
						     .device = sii_device_create(sii[i], SII_BYTES),
						     .ppm = 30.0 * i,
						     .parent = i - 1,
						     .parent_port = 1,
						     .wire_ns = 5,
						     .processing_ns = 150,
						     .forwarding_ns = 140 };
	}
	if (segment_create(spec, 2, 0, &segment) < 0) {
		abort();
	}
	segment_advance(segment, LOADED_NS);
	return segment;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct segment *segment = make_segment();
	int64_t t_ns = LOADED_NS;

	while (size >= HEAD_BYTES) {
		size_t len = get_le16(data) % (ECAT_FRAME_MAX_BYTES + 1);
		uint8_t *frame;
		int64_t back_ns;

		t_ns += (int64_t)get_le16(data + 2) * TIME_UNIT_NS;
		data += HEAD_BYTES;
		size -= HEAD_BYTES;
		len = len < size ? len : size;
		frame = malloc(len + 1); /* of its own size, for the sanitizer */
		if (frame == NULL) {
			break;
		}
		memcpy(frame, data, len);
		if (len > ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES) {
			frame[12] = ECAT_ETHERTYPE >> 8;
			frame[13] = ECAT_ETHERTYPE & 0xff;
			put_le16(frame + ECAT_ETHERNET_BYTES,
				 (uint16_t)((len - ECAT_ETHERNET_BYTES - ECAT_FRAME_HEADER_BYTES) |
					    1 << 12));
		}
		(void)segment_frame(segment, t_ns, frame, len, &back_ns);
		free(frame);
		data += len;
		size -= len;
	}
	segment_destroy(segment);
	return 0;
}
