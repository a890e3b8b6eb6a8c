/* SPDX-License-Identifier: MIT */
#include "mailbox/soe.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "mailbox/mailbox.h"
#include "wire/sii.h"

enum { SCALAR_MAX_BYTES = 8 };

static int start(struct mailbox_request *rq)
{
	const struct soe_parameters *with = &rq->with.soe;

	if ((with->operation != SOE_READ && with->operation != SOE_WRITE) ||
	    with->drive >= SOE_DRIVES || with->elements == 0 ||
	    (with->operation == SOE_WRITE && rq->capacity == 0)) {
		return -EINVAL;
	}
	if (with->operation == SOE_WRITE) {
		rq->total = rq->capacity;
	}
	return MAILBOX_SEND;
}

static int compose(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	const struct soe_parameters *with = &rq->with.soe;
	size_t left = with->operation == SOE_WRITE ? rq->capacity - rq->len : 0;
	size_t room = capacity > SOE_HEADER_BYTES ? capacity - SOE_HEADER_BYTES : 1;
	size_t now = left < room ? left : room;
	size_t mails_left = (left - now + room - 1) / room;

	if (mails_left > UINT16_MAX) {
		return -EMSGSIZE;
	}
	rq->state.soe.in_mail = now;
	return (int)soe_format(&(struct soe_message){ .operation = (uint8_t)with->operation,
						      .drive = with->drive,
						      .has_more = mails_left > 0,
						      .elements = with->elements,
						      .idn = with->idn,
						      .fragments_left = (uint16_t)mails_left,
						      .body = now > 0 ? rq->buffer + rq->len : NULL,
						      .body_len = now },
			       data, capacity);
}

/* Only the last fragment of a write is answered. */
static int sent(struct mailbox_request *rq)
{
	if (rq->with.soe.operation == SOE_READ) {
		return MAILBOX_WAIT;
	}
	rq->len += rq->state.soe.in_mail;
	return rq->len < rq->capacity ? MAILBOX_SEND : MAILBOX_WAIT;
}

/*
 * A value of more than 8 bytes is a list, and a list begins with its length in bytes: that a slave
 * left out the first fragments shows by nothing else.
 */
static int is_whole(const struct mailbox_request *rq)
{
	return rq->with.soe.elements != SOE_ELEMENT_VALUE || rq->len <= SCALAR_MAX_BYTES ||
	       get_le16(rq->buffer) == rq->len - SOE_LIST_HEADER_BYTES;
}

static int take_read(struct mailbox_request *rq, const struct soe_message *m)
{
	struct soe_state *st = &rq->state.soe;

	/* Each fragment leaves fewer behind, or the transfer would never end. */
	if (m->has_more && (m->fragments_left == 0 || m->body_len == 0 ||
			    (st->has_fragment && m->fragments_left >= st->fragments_left))) {
		return -EPROTO;
	}
	if (!m->has_more && m->idn != rq->with.soe.idn) {
		return -EPROTO;
	}
	if (m->body_len > rq->capacity - rq->len) {
		return -EMSGSIZE;
	}
	if (m->body_len > 0) {
		memcpy(rq->buffer + rq->len, m->body, m->body_len);
	}
	rq->len += m->body_len;
	st->has_fragment = 1;
	st->fragments_left = m->fragments_left;
	if (m->has_more) {
		return MAILBOX_WAIT;
	}
	return is_whole(rq) ? MAILBOX_DONE : -EPROTO;
}

static int received(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	const struct soe_parameters *with = &rq->with.soe;
	struct soe_message m;

	if (soe_parse(data, len, &m) < 0) {
		return -EPROTO;
	}
	if (m.operation == SOE_NOTIFICATION || m.operation == SOE_EMERGENCY ||
	    m.drive != with->drive) {
		return MAILBOX_IGNORE;
	}
	if (rq->has_gap) {
		return -EIO; /* a fragment before this one may be missing: nothing else would tell
			      */
	}
	if (m.operation != with->operation + 1) {
		return -EPROTO;
	}
	if (m.is_error) {
		rq->detail = get_le16(m.body);
		return -EREMOTEIO;
	}
	if (m.elements != with->elements) {
		return -EPROTO;
	}
	if (m.operation == SOE_READ_RESPONSE) {
		return take_read(rq, &m);
	}
	return m.has_more || m.idn != with->idn ? -EPROTO : MAILBOX_DONE;
}

const struct mailbox_protocol soe_protocol = {
	.type = MAILBOX_TYPE_SOE,
	.sii_bit = SII_MAILBOX_SOE,
	.start = start,
	.compose = compose,
	.sent = sent,
	.received = received,
};
