/* SPDX-License-Identifier: MIT */
#include "mailbox/aoe.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "mailbox/mailbox.h"
#include "wire/sii.h"

static int start(struct mailbox_request *rq)
{
	static uint32_t invoke_id; /* tells a late answer from this request's */
	const struct aoe_parameters *with = &rq->with.aoe;

	if (with->command != AOE_READ && with->command != AOE_WRITE) {
		return -EINVAL;
	}
	if (rq->mail_capacity < AOE_HEADER_BYTES + AOE_READ_BYTES ||
	    rq->mail_room < AOE_HEADER_BYTES + AOE_READ_ANSWER_BYTES ||
	    (with->command == AOE_WRITE &&
	     rq->capacity > (size_t)rq->mail_capacity - AOE_HEADER_BYTES - AOE_WRITE_BYTES)) {
		return -EMSGSIZE;
	}
	rq->state.aoe.invoke_id = ++invoke_id;
	return MAILBOX_SEND;
}

static uint32_t length_of(const struct mailbox_request *rq)
{
	size_t room = (size_t)rq->mail_room - AOE_HEADER_BYTES - AOE_READ_ANSWER_BYTES;

	return (uint32_t)(rq->with.aoe.command == AOE_WRITE || rq->capacity < room ? rq->capacity
										   : room);
}

static int compose(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	const struct aoe_parameters *with = &rq->with.aoe;
	size_t written = with->command == AOE_WRITE ? rq->capacity : 0;
	size_t len = AOE_READ_BYTES + written;
	uint8_t *body = data + AOE_HEADER_BYTES;

	if (AOE_HEADER_BYTES + len > capacity) {
		return -EMSGSIZE;
	}
	aoe_header_put(data, &(struct aoe_header){ .target = with->target,
						   .source = with->source,
						   .command = (uint16_t)with->command,
						   .flags = AOE_FLAG_COMMAND,
						   .data_len = (uint32_t)len,
						   .invoke_id = rq->state.aoe.invoke_id });
	put_le32(body, with->group);
	put_le32(body + 4, with->offset);
	put_le32(body + 8, length_of(rq));
	if (written > 0) {
		memcpy(body + AOE_WRITE_BYTES, rq->buffer, written);
	}
	return (int)(AOE_HEADER_BYTES + len);
}

static int refuse(struct mailbox_request *rq, uint32_t error)
{
	rq->detail = error;
	return -EREMOTEIO;
}

static int take_read(struct mailbox_request *rq, const uint8_t *body, size_t len)
{
	uint32_t bytes;

	if (len < AOE_READ_ANSWER_BYTES) {
		return -EPROTO;
	}
	bytes = get_le32(body + 4);
	if (bytes > len - AOE_READ_ANSWER_BYTES) {
		return -EPROTO;
	}
	if (bytes > rq->capacity) {
		return -EMSGSIZE;
	}
	if (bytes > 0) {
		memcpy(rq->buffer, body + AOE_READ_ANSWER_BYTES, bytes);
	}
	rq->len = rq->total = bytes;
	return MAILBOX_DONE;
}

static int received(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	const uint8_t *body = data + AOE_HEADER_BYTES;
	struct aoe_header h;

	if (aoe_header_get(data, len, &h) < 0) {
		return -EPROTO;
	}
	if (!(h.flags & AOE_FLAG_RESPONSE) || h.invoke_id != rq->state.aoe.invoke_id) {
		return MAILBOX_IGNORE;
	}
	if (h.error != 0) {
		return refuse(rq, h.error);
	}
	if (h.command != rq->with.aoe.command || h.data_len < AOE_WRITE_ANSWER_BYTES) {
		return -EPROTO;
	}
	if (get_le32(body) != 0) {
		return refuse(rq, get_le32(body));
	}
	if (h.command == AOE_READ) {
		return take_read(rq, body, h.data_len);
	}
	rq->len = rq->total = rq->capacity;
	return MAILBOX_DONE;
}

const struct mailbox_protocol aoe_protocol = {
	.type = MAILBOX_TYPE_AOE,
	.sii_bit = SII_MAILBOX_AOE,
	.start = start,
	.compose = compose,
	.received = received,
};
