/* SPDX-License-Identifier: MIT */
#include "mailbox/eoe.h"

#include <errno.h>

#include "mailbox/mailbox.h"
#include "wire/sii.h"

static int start(struct mailbox_request *rq)
{
	const struct eoe_parameters *with = &rq->with.eoe;

	if (with->port >= EOE_PORTS ||
	    (with->operation != EOE_SET_IP && with->operation != EOE_GET_IP &&
	     with->operation != EOE_FRAGMENT)) {
		return -EINVAL;
	}
	if (with->operation == EOE_FRAGMENT &&
	    (rq->capacity == 0 || rq->capacity > EOE_FRAME_MAX_BYTES ||
	     with->frame_number >= EOE_FRAME_NUMBERS)) {
		return -EINVAL;
	}
	if (rq->mail_capacity < EOE_HEADER_BYTES + EOE_BLOCK_BYTES ||
	    (with->operation == EOE_SET_IP &&
	     rq->mail_capacity < EOE_HEADER_BYTES + EOE_IP_BYTES)) {
		return -EMSGSIZE;
	}
	rq->state.eoe.split = (struct eoe_split){ .frame = rq->buffer,
						  .len = rq->capacity,
						  .frame_number = with->frame_number };
	return MAILBOX_SEND;
}

static int compose(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	const struct eoe_parameters *with = &rq->with.eoe;

	if (with->operation == EOE_FRAGMENT) {
		int len = (int)eoe_split_next(&rq->state.eoe.split, data, capacity);

		data[0] = (uint8_t)(data[0] | with->port << 4);
		return len;
	}
	eoe_header_put(data, &(struct eoe_header){ .type = (uint8_t)with->operation,
						   .port = with->port,
						   .is_last = 1 });
	if (with->operation == EOE_GET_IP) {
		return EOE_HEADER_BYTES;
	}
	eoe_ip_put(data + EOE_HEADER_BYTES, &with->ip);
	return EOE_HEADER_BYTES + EOE_IP_BYTES;
}

/* Fragments are not answered. */
static int sent(struct mailbox_request *rq)
{
	if (rq->with.eoe.operation != EOE_FRAGMENT) {
		return MAILBOX_WAIT;
	}
	rq->len = rq->state.eoe.split.pos;
	return rq->len < rq->capacity ? MAILBOX_SEND : MAILBOX_DONE;
}

static int received(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	struct eoe_header h;

	if (eoe_header_get(data, len, &h) < 0 || h.type != rq->with.eoe.operation + 1 ||
	    rq->with.eoe.operation == EOE_FRAGMENT) {
		return MAILBOX_IGNORE; /* a frame's fragment, or an answer to somebody else */
	}
	if (h.result != EOE_SUCCESS) {
		rq->detail = h.result;
		return -EREMOTEIO;
	}
	if (rq->with.eoe.operation == EOE_GET_IP &&
	    eoe_ip_get(data + EOE_HEADER_BYTES, len - EOE_HEADER_BYTES, &rq->state.eoe.ip) < 0) {
		return -EPROTO;
	}
	return MAILBOX_DONE;
}

const struct mailbox_protocol eoe_protocol = {
	.type = MAILBOX_TYPE_EOE,
	.sii_bit = SII_MAILBOX_EOE,
	.start = start,
	.compose = compose,
	.sent = sent,
	.received = received,
};
