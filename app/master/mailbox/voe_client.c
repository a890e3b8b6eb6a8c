/* SPDX-License-Identifier: MIT */
#include "mailbox/voe.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "mailbox/mailbox.h"
#include "wire/sii.h"
#include "wire/voe.h"

static int start(struct mailbox_request *rq)
{
	size_t len = rq->with.voe.len;

	return len <= rq->capacity && len + VOE_HEADER_BYTES <= rq->mail_capacity ? MAILBOX_SEND
										  : -EINVAL;
}

static int compose(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	const struct voe_parameters *with = &rq->with.voe;

	if (with->len + VOE_HEADER_BYTES > capacity) {
		return -EINVAL;
	}
	put_le32(data + VOE_VENDOR, with->vendor);
	put_le16(data + VOE_TYPE, with->type);
	if (with->len > 0) {
		memcpy(data + VOE_HEADER_BYTES, rq->buffer, with->len);
	}
	return (int)(VOE_HEADER_BYTES + with->len);
}

static int sent(struct mailbox_request *rq)
{
	return rq->with.voe.expect == VOE_NO_ANSWER ? MAILBOX_DONE : MAILBOX_WAIT;
}

static int received(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	if (len < VOE_HEADER_BYTES || get_le32(data + VOE_VENDOR) != rq->with.voe.vendor) {
		return MAILBOX_IGNORE;
	}
	if (len - VOE_HEADER_BYTES > rq->capacity) {
		return -EMSGSIZE;
	}
	rq->state.voe.type = get_le16(data + VOE_TYPE);
	rq->len = rq->total = len - VOE_HEADER_BYTES;
	if (rq->len > 0) {
		memcpy(rq->buffer, data + VOE_HEADER_BYTES, rq->len);
	}
	return MAILBOX_DONE;
}

const struct mailbox_protocol voe_protocol = {
	.type = MAILBOX_TYPE_VOE,
	.sii_bit = SII_MAILBOX_VOE,
	.start = start,
	.compose = compose,
	.sent = sent,
	.received = received,
};
