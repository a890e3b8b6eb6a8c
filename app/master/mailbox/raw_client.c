/* SPDX-License-Identifier: MIT */
#include "mailbox/raw.h"

#include <errno.h>
#include <string.h>

#include "mailbox/raw_internal.h"
#include "wire/sii.h"

static int start(struct mailbox_request *rq)
{
	return rq->capacity > 0 && rq->capacity <= rq->mail_capacity ? MAILBOX_SEND : -EMSGSIZE;
}

static int compose(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	if (rq->capacity > capacity) {
		return -EMSGSIZE;
	}
	memcpy(data, rq->buffer, rq->capacity);
	return (int)rq->capacity;
}

static int sent(struct mailbox_request *rq)
{
	rq->len = rq->capacity;
	return raw_is_answered(rq) ? MAILBOX_WAIT : MAILBOX_DONE;
}

static int received(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	struct raw_state *st = &rq->state.raw;
	uint16_t left;

	if (!raw_is_answer(rq, data, len)) {
		return MAILBOX_IGNORE;
	}
	left = raw_fragments_left(rq, data, len);
	/* Each fragment leaves fewer behind, or the answer would never end. */
	if (st->has_fragment && left >= st->fragments_left) {
		return -EPROTO;
	}
	st->has_fragment = 1;
	st->fragments_left = left;
	rq->with.raw.answer(rq, data, len);
	return left > 0 ? MAILBOX_WAIT : MAILBOX_DONE;
}

static int give_up(struct mailbox_request *rq, int error, uint8_t *data, size_t capacity)
{
	(void)error;
	return raw_abort(rq, data, capacity);
}

#define RAW(name, bit)                                                                             \
	[MAILBOX_TYPE_##name] = { .type = MAILBOX_TYPE_##name,                                     \
				  .sii_bit = (bit),                                                \
				  .start = start,                                                  \
				  .compose = compose,                                              \
				  .sent = sent,                                                    \
				  .received = received,                                            \
				  .give_up = give_up }

const struct mailbox_protocol *raw_protocol(enum mailbox_type type)
{
	static const struct mailbox_protocol protocols[MAILBOX_TYPES] = {
		RAW(AOE, SII_MAILBOX_AOE), RAW(EOE, SII_MAILBOX_EOE), RAW(COE, SII_MAILBOX_COE),
		RAW(FOE, SII_MAILBOX_FOE), RAW(SOE, SII_MAILBOX_SOE), RAW(VOE, SII_MAILBOX_VOE),
	};

	return (unsigned)type < MAILBOX_TYPES && protocols[type].start != NULL ? &protocols[type]
									       : NULL;
}
