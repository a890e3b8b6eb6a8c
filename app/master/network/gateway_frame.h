/* SPDX-License-Identifier: MIT */
/*
 * What travels between a client and the mailbox gateway (ETG.8200): an EtherCAT header of type 5,
 * and one mailbox message with its header. Bytes may be anything. Context: any.
 */
#ifndef NETWORK_GATEWAY_FRAME_H
#define NETWORK_GATEWAY_FRAME_H

#include <stddef.h>
#include <stdint.h>

#include "wire/mailbox.h"

enum {
	GATEWAY_HEADER_BYTES = 2,
	GATEWAY_DATA_BYTES = MAILBOX_BYTES - MAILBOX_HEADER_BYTES,
	GATEWAY_FRAME_BYTES = GATEWAY_HEADER_BYTES + MAILBOX_BYTES,
};

struct gateway_mail {
	struct mailbox_header header;
	const uint8_t *data; /* header.data_len bytes */
};

/**
 * The message at the beginning of @bytes. Length of its frame; 0: it is not whole yet; -EBADMSG: no
 * frame of this kind.
 */
int gateway_frame_get(const uint8_t *bytes, size_t len, struct gateway_mail *ret);
/** The frame of @mail, at most GATEWAY_DATA_BYTES of data, at @bytes. Its length. */
size_t gateway_frame_put(uint8_t *bytes, const struct gateway_mail *mail);

#endif
