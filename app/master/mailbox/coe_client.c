/* SPDX-License-Identifier: MIT */
#include "mailbox/coe.h"

#include <errno.h>
#include <string.h>

#include "mailbox/coe_internal.h"
#include "wire/sii.h"

static int is_information(const struct mailbox_request *rq)
{
	return rq->with.coe.operation >= COE_LIST;
}

/* --- requests --- */

static int start(struct mailbox_request *rq)
{
	const struct coe_parameters *with = &rq->with.coe;

	if (with->operation > COE_ENTRY || rq->capacity > UINT32_MAX ||
	    (with->access == COE_ACCESS_COMPLETE && with->subindex > 1) ||
	    (with->operation == COE_DOWNLOAD && rq->capacity == 0)) {
		return -EINVAL;
	}
	rq->total = with->operation == COE_DOWNLOAD ? rq->capacity : 0;
	return MAILBOX_SEND;
}

static void put_request(const struct mailbox_request *rq, uint8_t command, uint8_t *data)
{
	memset(data, 0, SDO_BYTES);
	put_le16(data, COE_SDO_REQUEST << COE_SERVICE_SHIFT);
	data[SDO_COMMAND_AT] = command;
	put_le16(data + SDO_INDEX_AT, rq->with.coe.index);
	data[SDO_SUBINDEX_AT] = rq->with.coe.subindex;
}

static uint8_t access_bit(const struct mailbox_request *rq)
{
	return rq->with.coe.access == COE_ACCESS_COMPLETE ? SDO_COMPLETE_ACCESS : 0;
}

static int compose_download(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	size_t room = capacity - SDO_BYTES;
	uint8_t access = access_bit(rq);

	if (rq->total <= SDO_EXPEDITED_BYTES && access == 0) {
		size_t unused = SDO_EXPEDITED_BYTES - rq->total;

		put_request(rq,
			    (uint8_t)(SDO_DOWNLOAD | SDO_EXPEDITED | SDO_SIZE_INDICATED |
				      unused << SDO_EXPEDITED_SHIFT),
			    data);
		memcpy(data + SDO_DATA_AT, rq->buffer, rq->total);
		rq->state.coe.in_mail = rq->total;
		return SDO_BYTES;
	}
	put_request(rq, (uint8_t)(SDO_DOWNLOAD | SDO_SIZE_INDICATED | access), data);
	put_le32(data + SDO_DATA_AT, (uint32_t)rq->total);
	rq->state.coe.in_mail = rq->total < room ? rq->total : room;
	memcpy(data + SDO_BYTES, rq->buffer, rq->state.coe.in_mail);
	return (int)(SDO_BYTES + rq->state.coe.in_mail);
}

static int compose_download_segment(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	size_t room = capacity - SDO_SEGMENT_AT;
	size_t left = rq->total - rq->len;
	size_t now = left < room ? left : room;
	size_t filled = now < SDO_SEGMENT_MIN ? SDO_SEGMENT_MIN : now;

	memset(data, 0, SDO_SEGMENT_AT + SDO_SEGMENT_MIN);
	put_le16(data, COE_SDO_REQUEST << COE_SERVICE_SHIFT);
	data[SDO_COMMAND_AT] = (uint8_t)(SDO_DOWNLOAD_SEGMENT | rq->state.coe.toggle |
					 (filled - now) << SDO_UNUSED_SHIFT |
					 (now == left ? SDO_LAST_SEGMENT : 0));
	memcpy(data + SDO_SEGMENT_AT, rq->buffer + rq->len, now);
	rq->state.coe.in_mail = now;
	return (int)(SDO_SEGMENT_AT + filled);
}

static int compose(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	struct coe_state *st = &rq->state.coe;

	if (is_information(rq)) {
		return coe_information_compose(rq, data, capacity);
	}
	if (rq->with.coe.operation == COE_UPLOAD) {
		put_request(rq,
			    (uint8_t)(st->is_segmented ? SDO_UPLOAD_SEGMENT | st->toggle
						       : SDO_UPLOAD | access_bit(rq)),
			    data);
		if (st->is_segmented) {
			memset(data + SDO_INDEX_AT, 0, SDO_BYTES - SDO_INDEX_AT);
		}
		st->is_begun = 1;
		return SDO_BYTES;
	}
	st->is_begun = 1;
	return st->is_segmented ? compose_download_segment(rq, data, capacity)
				: compose_download(rq, data, capacity);
}

/* --- answers --- */

/* A reply that breaks the protocol: send the slave an abort. */
static int reject(struct mailbox_request *rq, uint32_t abort)
{
	rq->state.coe.abort = abort;
	return abort == COE_ABORT_MEMORY ? -EMSGSIZE : -EPROTO;
}

static int uploaded(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	uint8_t command = data[SDO_COMMAND_AT];
	const uint8_t *bytes = data + SDO_BYTES;
	size_t now = len - SDO_BYTES;

	if (command & SDO_EXPEDITED) {
		bytes = data + SDO_DATA_AT;
		now = command & SDO_SIZE_INDICATED
			      ? SDO_EXPEDITED_BYTES - (size_t)(command >> SDO_EXPEDITED_SHIFT &
							       SDO_EXPEDITED_MASK)
			      : SDO_EXPEDITED_BYTES;
		rq->total = now;
		rq->state.coe.is_begun = 0;
	} else {
		rq->total = get_le32(data + SDO_DATA_AT);
		now = now < rq->total ? now : rq->total;
	}
	if (rq->total > rq->capacity) {
		return reject(rq, COE_ABORT_MEMORY);
	}
	memcpy(rq->buffer, bytes, now);
	rq->len = now;
	if (now == rq->total) {
		return MAILBOX_DONE;
	}
	rq->state.coe.is_segmented = 1;
	return MAILBOX_SEND;
}

static int segment_uploaded(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	uint8_t command = data[SDO_COMMAND_AT];
	int is_last = command & SDO_LAST_SEGMENT;
	size_t now = len - SDO_SEGMENT_AT;

	if ((command & SDO_TOGGLE) != rq->state.coe.toggle) {
		return reject(rq, COE_ABORT_TOGGLE);
	}
	if (now == SDO_SEGMENT_MIN) {
		now -= command >> SDO_UNUSED_SHIFT & SDO_UNUSED_MASK;
	}
	if (now > rq->total - rq->len || (now == 0 && !is_last) ||
	    (is_last != 0) != (now == rq->total - rq->len)) {
		return reject(rq, COE_ABORT_LENGTH);
	}
	memcpy(rq->buffer + rq->len, data + SDO_SEGMENT_AT, now);
	rq->len += now;
	rq->state.coe.toggle ^= SDO_TOGGLE;
	return is_last ? MAILBOX_DONE : MAILBOX_SEND;
}

/* The slave has taken what the last mail carried. */
static int downloaded(struct mailbox_request *rq)
{
	rq->len += rq->state.coe.in_mail;
	rq->state.coe.is_segmented = 1;
	return rq->len == rq->total ? MAILBOX_DONE : MAILBOX_SEND;
}

static int segment_downloaded(struct mailbox_request *rq, uint8_t command)
{
	if ((command & SDO_TOGGLE) != rq->state.coe.toggle) {
		return reject(rq, COE_ABORT_TOGGLE);
	}
	rq->state.coe.toggle ^= SDO_TOGGLE;
	return downloaded(rq);
}

static int is_of_object(const struct mailbox_request *rq, const uint8_t *data)
{
	return get_le16(data + SDO_INDEX_AT) == rq->with.coe.index &&
	       data[SDO_SUBINDEX_AT] == rq->with.coe.subindex;
}

/* Answers to other objects, or of the other direction, are late ones to an earlier request. */
static int received_sdo(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	const struct coe_state *st = &rq->state.coe;
	int is_upload = rq->with.coe.operation == COE_UPLOAD;
	uint8_t command = data[SDO_COMMAND_AT];
	uint8_t expected = is_upload ? SDO_UPLOADED : SDO_DOWNLOADED;

	if ((command & SDO_SPECIFIER) == SDO_ABORT) {
		if (len < SDO_BYTES || !is_of_object(rq, data)) {
			return MAILBOX_IGNORE;
		}
		rq->detail = get_le32(data + SDO_DATA_AT);
		rq->state.coe.is_begun = 0;
		return -EREMOTEIO;
	}
	if (st->is_segmented) {
		expected = is_upload ? SDO_SEGMENT_UPLOADED : SDO_SEGMENT_DOWNLOADED;
		if ((command & SDO_SPECIFIER) != expected ||
		    len < SDO_SEGMENT_AT + SDO_SEGMENT_MIN) {
			return reject(rq, COE_ABORT_COMMAND);
		}
		return is_upload ? segment_uploaded(rq, data, len)
				 : segment_downloaded(rq, command);
	}
	if (len < SDO_BYTES) {
		return reject(rq, COE_ABORT_COMMAND);
	}
	if (!is_of_object(rq, data)) {
		return MAILBOX_IGNORE;
	}
	if ((command & SDO_SPECIFIER) != expected) {
		return (command & SDO_SPECIFIER) == (is_upload ? SDO_DOWNLOADED : SDO_UPLOADED)
			       ? MAILBOX_IGNORE
			       : reject(rq, COE_ABORT_COMMAND);
	}
	return is_upload ? uploaded(rq, data, len) : downloaded(rq);
}

static int received(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	unsigned service;

	if (len <= SDO_COMMAND_AT) {
		return reject(rq, COE_ABORT_COMMAND);
	}
	service = get_le16(data) >> COE_SERVICE_SHIFT;
	if (is_information(rq)) {
		return service == COE_SDO_INFORMATION ? coe_information_received(rq, data, len)
						      : MAILBOX_IGNORE;
	}
	/* An abort may come as a request. */
	if (service == COE_SDO_RESPONSE ||
	    (service == COE_SDO_REQUEST && (data[SDO_COMMAND_AT] & SDO_SPECIFIER) == SDO_ABORT)) {
		return received_sdo(rq, data, len);
	}
	return MAILBOX_IGNORE;
}

static int give_up(struct mailbox_request *rq, int error, uint8_t *data, size_t capacity)
{
	uint32_t abort = rq->state.coe.abort;

	if (!rq->state.coe.is_begun || capacity < SDO_BYTES) {
		return 0;
	}
	if (abort == 0) {
		abort = error == -ETIMEDOUT ? COE_ABORT_TIMEOUT : COE_ABORT_GENERAL;
	}
	put_request(rq, SDO_ABORT, data);
	put_le32(data + SDO_DATA_AT, abort);
	return SDO_BYTES;
}

const struct mailbox_protocol coe_protocol = {
	.type = MAILBOX_TYPE_COE,
	.sii_bit = SII_MAILBOX_COE,
	.start = start,
	.compose = compose,
	.received = received,
	.give_up = give_up,
};

int coe_emergency_get(const uint8_t *data, size_t len, struct coe_emergency *ret)
{
	if (len < COE_HEADER_BYTES + 8 || get_le16(data) >> COE_SERVICE_SHIFT != COE_EMERGENCY) {
		return 0;
	}
	ret->code = get_le16(data + COE_HEADER_BYTES);
	ret->error_register = data[COE_HEADER_BYTES + 2];
	memcpy(ret->data, data + COE_HEADER_BYTES + 3, sizeof(ret->data));
	return 1;
}
