/* SPDX-License-Identifier: MIT */
#include <assert.h>
#include <errno.h>
#include <string.h>

#include "mailbox/raw_internal.h"
#include "wire/coe.h"
#include "wire/foe.h"
#include "wire/voe.h"

static unsigned coe_service(const uint8_t *data, size_t len)
{
	return len > SDO_COMMAND_AT ? get_le16(data) >> COE_SERVICE_SHIFT : 0;
}

static uint8_t sdo_specifier(const uint8_t *data)
{
	return data[SDO_COMMAND_AT] & SDO_SPECIFIER;
}

/* A request that names its object; segments do not. */
static int is_sdo_initiate(const uint8_t *data, size_t len)
{
	return coe_service(data, len) == COE_SDO_REQUEST && len >= SDO_BYTES &&
	       (sdo_specifier(data) == SDO_DOWNLOAD || sdo_specifier(data) == SDO_UPLOAD);
}

static int is_sdo_request(const uint8_t *data, size_t len)
{
	return coe_service(data, len) == COE_SDO_REQUEST && sdo_specifier(data) != SDO_ABORT;
}

static int is_sdo_answer(const struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	unsigned service = coe_service(data, len);
	int is_abort = len >= SDO_BYTES && sdo_specifier(data) == SDO_ABORT;
	static const uint8_t expected[] = {
		[SDO_DOWNLOAD >> 5] = SDO_DOWNLOADED,
		[SDO_UPLOAD >> 5] = SDO_UPLOADED,
		[SDO_DOWNLOAD_SEGMENT >> 5] = SDO_SEGMENT_DOWNLOADED,
		[SDO_UPLOAD_SEGMENT >> 5] = SDO_SEGMENT_UPLOADED,
	};

	if (service != COE_SDO_RESPONSE && !(service == COE_SDO_REQUEST && is_abort)) {
		return 0;
	}
	if (is_sdo_initiate(rq->buffer, rq->capacity) &&
	    (len < SDO_BYTES || memcmp(data + SDO_INDEX_AT, rq->buffer + SDO_INDEX_AT, 3) != 0)) {
		return 0; /* of another object: a late one to an earlier request */
	}
	return is_abort || sdo_specifier(rq->buffer) > SDO_UPLOAD_SEGMENT ||
	       sdo_specifier(data) == expected[sdo_specifier(rq->buffer) >> 5];
}

static int is_coe_answer(const struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	if (coe_service(rq->buffer, rq->capacity) == COE_SDO_INFORMATION) {
		return coe_service(data, len) == COE_SDO_INFORMATION;
	}
	return is_sdo_answer(rq, data, len);
}

static int is_soe_answer(const struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	struct soe_message asked;
	struct soe_message m;

	return soe_parse(rq->buffer, rq->capacity, &asked) == 0 && soe_parse(data, len, &m) == 0 &&
	       m.operation == asked.operation + 1 && m.drive == asked.drive;
}

static int is_aoe_answer(const struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	struct aoe_header asked;
	struct aoe_header h;

	return aoe_header_get(rq->buffer, rq->capacity, &asked) == 0 &&
	       aoe_header_get(data, len, &h) == 0 && (h.flags & AOE_FLAG_RESPONSE) &&
	       h.invoke_id == asked.invoke_id;
}

static int is_eoe_answer(const struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	struct eoe_header asked;
	struct eoe_header h;

	return eoe_header_get(rq->buffer, rq->capacity, &asked) == 0 &&
	       eoe_header_get(data, len, &h) == 0 && h.type == asked.type + 1;
}

static int is_voe_answer(const struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	return len >= VOE_HEADER_BYTES && rq->capacity >= VOE_HEADER_BYTES &&
	       get_le32(data + VOE_VENDOR) == get_le32(rq->buffer + VOE_VENDOR);
}

int raw_is_answer(const struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	switch (rq->protocol->type) {
	case MAILBOX_TYPE_COE:
		return is_coe_answer(rq, data, len);
	case MAILBOX_TYPE_SOE:
		return is_soe_answer(rq, data, len);
	case MAILBOX_TYPE_AOE:
		return is_aoe_answer(rq, data, len);
	case MAILBOX_TYPE_EOE:
		return is_eoe_answer(rq, data, len);
	case MAILBOX_TYPE_VOE:
		return is_voe_answer(rq, data, len);
	case MAILBOX_TYPE_FOE:
		return 1;
	case MAILBOX_TYPE_ERROR:
		break;
	}
	return 0;
}

static int is_coe_answered(const uint8_t *data, size_t len)
{
	return coe_service(data, len) == COE_SDO_INFORMATION || is_sdo_request(data, len);
}

static int is_foe_answered(const struct mailbox_request *rq)
{
	struct foe_message m;

	return foe_parse(rq->buffer, rq->capacity, &m) == 0 && m.operation != FOE_ERROR &&
	       !(m.operation == FOE_ACK && rq->with.raw.is_last);
}

int raw_is_answered(const struct mailbox_request *rq)
{
	struct soe_message soe;
	struct aoe_header aoe;
	struct eoe_header eoe;

	switch (rq->protocol->type) {
	case MAILBOX_TYPE_COE:
		return is_coe_answered(rq->buffer, rq->capacity);
	case MAILBOX_TYPE_FOE:
		return is_foe_answered(rq);
	case MAILBOX_TYPE_SOE: /* of the fragments of a write only the last one */
		return soe_parse(rq->buffer, rq->capacity, &soe) == 0 &&
		       (soe.operation == SOE_READ || (soe.operation == SOE_WRITE && !soe.has_more));
	case MAILBOX_TYPE_AOE:
		return aoe_header_get(rq->buffer, rq->capacity, &aoe) == 0 &&
		       !(aoe.flags & AOE_FLAG_RESPONSE);
	case MAILBOX_TYPE_EOE: /* requests are even, their answers odd */
		return eoe_header_get(rq->buffer, rq->capacity, &eoe) == 0 &&
		       eoe.type != EOE_FRAGMENT && eoe.type % 2 == 0;
	case MAILBOX_TYPE_VOE:
		return 1;
	case MAILBOX_TYPE_ERROR:
		break;
	}
	return 0;
}

uint16_t raw_fragments_left(const struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	struct soe_message m;

	if (rq->protocol->type == MAILBOX_TYPE_COE &&
	    coe_service(data, len) == COE_SDO_INFORMATION) {
		return len >= SDO_INFORMATION_BODY_AT &&
				       (data[SDO_INFORMATION_OPCODE_AT] &
					SDO_INFORMATION_OPCODE_MASK) != SDO_INFORMATION_ERROR
			       ? get_le16(data + SDO_INFORMATION_FRAGMENTS_AT)
			       : 0;
	}
	if (rq->protocol->type == MAILBOX_TYPE_SOE && soe_parse(data, len, &m) == 0) {
		return m.has_more ? m.fragments_left : 0;
	}
	return 0;
}

static void put_abort(const uint8_t *request, size_t len, uint32_t code, uint8_t *data)
{
	memset(data, 0, SDO_BYTES);
	put_le16(data, COE_SDO_REQUEST << COE_SERVICE_SHIFT);
	data[SDO_COMMAND_AT] = SDO_ABORT;
	if (is_sdo_initiate(request, len)) {
		memcpy(data + SDO_INDEX_AT, request + SDO_INDEX_AT, 3);
	}
	put_le32(data + SDO_DATA_AT, code);
}

int raw_abort(const struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	if (rq->protocol->type != MAILBOX_TYPE_COE || capacity < SDO_BYTES ||
	    !is_sdo_request(rq->buffer, rq->capacity)) {
		return 0;
	}
	put_abort(rq->buffer, rq->capacity, COE_ABORT_TIMEOUT, data);
	return SDO_BYTES;
}

static_assert((int)RAW_ABORT_BYTES == (int)SDO_BYTES, "an abort has no data");

int raw_refuse_sdo(const uint8_t *data, size_t len, uint8_t *ret_answer)
{
	if (!is_sdo_request(data, len)) {
		return -EBADMSG;
	}
	put_abort(data, len, COE_ABORT_NO_OBJECT, ret_answer);
	return 0;
}

/* --- transfers --- */

/* Does an initiated transfer of the size in @data leave something for segments? */
static int has_segments(const uint8_t *data, size_t len)
{
	return len >= SDO_BYTES && !(data[SDO_COMMAND_AT] & SDO_EXPEDITED) &&
	       get_le32(data + SDO_DATA_AT) > len - SDO_BYTES;
}

static enum raw_transfer after_sdo(const struct mailbox_request *rq, const uint8_t *answer,
				   size_t answer_len)
{
	int goes_on = 0;

	if (coe_service(rq->buffer, rq->capacity) != COE_SDO_REQUEST ||
	    coe_service(answer, answer_len) != COE_SDO_RESPONSE ||
	    sdo_specifier(answer) == SDO_ABORT) {
		return RAW_TRANSFER_NONE;
	}
	switch (sdo_specifier(rq->buffer)) {
	case SDO_UPLOAD:
		goes_on = has_segments(answer, answer_len);
		break;
	case SDO_UPLOAD_SEGMENT:
		goes_on = !(answer[SDO_COMMAND_AT] & SDO_LAST_SEGMENT);
		break;
	case SDO_DOWNLOAD:
		goes_on = has_segments(rq->buffer, rq->capacity);
		break;
	case SDO_DOWNLOAD_SEGMENT:
		goes_on = !(rq->buffer[SDO_COMMAND_AT] & SDO_LAST_SEGMENT);
		break;
	default:
		break;
	}
	return goes_on ? RAW_TRANSFER_GOES_ON : RAW_TRANSFER_NONE;
}

/* A packet that does not fill its mail is the last one. */
static enum raw_transfer after_foe(const struct mailbox_request *rq, const uint8_t *answer,
				   size_t answer_len)
{
	struct foe_message asked;
	struct foe_message m;

	if (foe_parse(rq->buffer, rq->capacity, &asked) < 0 ||
	    foe_parse(answer, answer_len, &m) < 0) {
		return RAW_TRANSFER_NONE;
	}
	switch (m.operation) {
	case FOE_DATA:
		return answer_len < rq->mail_room ? RAW_TRANSFER_LAST : RAW_TRANSFER_GOES_ON;
	case FOE_ACK:
		return asked.operation == FOE_DATA && rq->capacity < rq->mail_capacity
			       ? RAW_TRANSFER_NONE
			       : RAW_TRANSFER_GOES_ON;
	case FOE_BUSY:
		return RAW_TRANSFER_GOES_ON;
	default: /* an error, or nonsense */
		return RAW_TRANSFER_NONE;
	}
}

enum raw_transfer raw_transfer_after(const struct mailbox_request *rq, const uint8_t *answer,
				     size_t answer_len)
{
	struct soe_message m;

	switch (rq->protocol->type) {
	case MAILBOX_TYPE_COE:
		return after_sdo(rq, answer, answer_len);
	case MAILBOX_TYPE_FOE:
		return after_foe(rq, answer, answer_len);
	case MAILBOX_TYPE_SOE:
		return soe_parse(rq->buffer, rq->capacity, &m) == 0 && m.has_more &&
				       m.operation == SOE_WRITE
			       ? RAW_TRANSFER_GOES_ON
			       : RAW_TRANSFER_NONE;
	case MAILBOX_TYPE_ERROR:
	case MAILBOX_TYPE_AOE:
	case MAILBOX_TYPE_EOE:
	case MAILBOX_TYPE_VOE:
		break;
	}
	return RAW_TRANSFER_NONE;
}
