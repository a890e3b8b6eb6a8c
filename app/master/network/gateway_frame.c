/* SPDX-License-Identifier: MIT */
#include "network/gateway_frame.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"

enum { LENGTH_MASK = 0x07ff, TYPE_SHIFT = 12, TYPE_MAILBOX = 5 };

int gateway_frame_get(const uint8_t *bytes, size_t len, struct gateway_mail *ret)
{
	struct mailbox_header header;
	size_t body;

	if (len < GATEWAY_HEADER_BYTES) {
		return 0;
	}
	body = get_le16(bytes) & LENGTH_MASK;
	if (get_le16(bytes) >> TYPE_SHIFT != TYPE_MAILBOX || body < MAILBOX_HEADER_BYTES ||
	    body > MAILBOX_BYTES) {
		return -EBADMSG;
	}
	if (len < GATEWAY_HEADER_BYTES + body) {
		return 0;
	}
	header = mailbox_header_get(bytes + GATEWAY_HEADER_BYTES);
	if (MAILBOX_HEADER_BYTES + (size_t)header.data_len > body) {
		return -EBADMSG;
	}
	*ret = (struct gateway_mail){ .header = header,
				      .data = bytes + GATEWAY_HEADER_BYTES + MAILBOX_HEADER_BYTES };
	return (int)(GATEWAY_HEADER_BYTES + body);
}

size_t gateway_frame_put(uint8_t *bytes, const struct gateway_mail *mail)
{
	size_t body = MAILBOX_HEADER_BYTES + (size_t)mail->header.data_len;

	put_le16(bytes, (uint16_t)(body | TYPE_MAILBOX << TYPE_SHIFT));
	mailbox_header_put(bytes + GATEWAY_HEADER_BYTES, &mail->header);
	memcpy(bytes + GATEWAY_HEADER_BYTES + MAILBOX_HEADER_BYTES, mail->data,
	       mail->header.data_len);
	return GATEWAY_HEADER_BYTES + body;
}
