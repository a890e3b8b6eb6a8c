/* SPDX-License-Identifier: MIT */
#include "devices/coe_information.h"

#include <string.h>

#include "base/bytes.h"
#include "wire/coe.h"

enum { BODY_AT = SDO_INFORMATION_BODY_AT, ERROR_BYTES = BODY_AT + 4 };

enum list_type { LIST_LENGTHS = 0, LIST_ALL = 1, LIST_TYPES = 5 };

enum object_code { OBJECT_VARIABLE = 7, OBJECT_RECORD = 9 };

enum { ACCESS_READ = 0x0007 }; /* in PRE-OP, SAFE-OP and OP */

static void put_header(const uint8_t *request, enum sdo_information_opcode opcode, uint8_t *answer)
{
	memcpy(answer, request, 2);
	answer[SDO_INFORMATION_OPCODE_AT] = (uint8_t)opcode;
	memset(answer + SDO_INFORMATION_OPCODE_AT + 1, 0, 3); /* no fragments follow */
}

static size_t refuse(const uint8_t *request, enum coe_abort code, uint8_t *answer)
{
	put_header(request, SDO_INFORMATION_ERROR, answer);
	put_le32(answer + BODY_AT, (uint32_t)code);
	return ERROR_BYTES;
}

static size_t put_text(uint8_t *at, const char *text, size_t room)
{
	size_t len = strnlen(text, room);

	memcpy(at, text, len);
	return len;
}

/* Five lengths; or as many indices as there are, which fit into one mailbox or are refused. */
static size_t answer_list(const struct coe_dictionary *d, const uint8_t *request, uint8_t *answer,
			  size_t capacity)
{
	uint16_t type = get_le16(request + BODY_AT);
	size_t len = BODY_AT + 2;
	uint16_t count = 0;

	if (type > LIST_ALL) {
		return refuse(request, COE_ABORT_ACCESS, answer);
	}
	put_header(request, SDO_LIST, answer);
	put_le16(answer + BODY_AT, type);
	for (uint16_t i = coe_dictionary_next(d, 0); i != 0; i = coe_dictionary_next(d, i)) {
		count++;
		if (type == LIST_LENGTHS) {
			continue;
		}
		if (len + 2 > capacity) {
			return refuse(request, COE_ABORT_ACCESS, answer);
		}
		put_le16(answer + len, i);
		len += 2;
	}
	if (type == LIST_LENGTHS) {
		if (len + (size_t)2 * LIST_TYPES > capacity) {
			return refuse(request, COE_ABORT_ACCESS, answer);
		}
		memset(answer + len, 0, (size_t)2 * LIST_TYPES);
		put_le16(answer + len, count);
		len += (size_t)2 * LIST_TYPES;
	}
	return len;
}

static size_t answer_object(const struct coe_dictionary *d, const uint8_t *request, uint8_t *answer,
			    size_t capacity)
{
	uint16_t index = get_le16(request + BODY_AT);
	struct coe_entry_info info;
	struct coe_value first;
	enum coe_abort code = coe_dictionary_entry_info(d, index, 0, &info);
	int is_record = coe_dictionary_entry_info(d, index, 1, &info) == COE_OK;

	if (code == COE_OK) {
		code = coe_dictionary_read(d, index, 0, &first);
	}
	if (code != COE_OK || capacity < BODY_AT + SDO_OBJECT_BYTES) {
		return refuse(request, code != COE_OK ? code : COE_ABORT_ACCESS, answer);
	}
	put_header(request, SDO_OBJECT, answer);
	put_le16(answer + BODY_AT, index);
	put_le16(answer + BODY_AT + 2, is_record ? 0 : info.data_type);
	answer[BODY_AT + 4] = is_record ? first.bytes[0] : 0;
	answer[BODY_AT + 5] = is_record ? OBJECT_RECORD : OBJECT_VARIABLE;
	return BODY_AT + SDO_OBJECT_BYTES;
}

static size_t answer_entry(const struct coe_dictionary *d, const uint8_t *request, uint8_t *answer,
			   size_t capacity)
{
	uint16_t index = get_le16(request + BODY_AT);
	uint8_t subindex = request[BODY_AT + 2];
	struct coe_entry_info info;
	enum coe_abort code = coe_dictionary_entry_info(d, index, subindex, &info);
	size_t len = BODY_AT + SDO_ENTRY_BYTES;

	if (code != COE_OK || capacity < len + SDO_ENTRY_UNIT_BYTES) {
		return refuse(request, code != COE_OK ? code : COE_ABORT_ACCESS, answer);
	}
	put_header(request, SDO_ENTRY, answer);
	put_le16(answer + BODY_AT, index);
	answer[BODY_AT + 2] = subindex;
	answer[BODY_AT + 3] = 0; /* of the optional values only a unit is sent */
	put_le16(answer + BODY_AT + 4, info.data_type);
	put_le16(answer + BODY_AT + 6, info.bit_len);
	put_le16(answer + BODY_AT + 8, ACCESS_READ);
	if (info.unit != 0 && (request[BODY_AT + 3] & SDO_VALUE_UNIT) != 0) {
		answer[BODY_AT + 3] = SDO_VALUE_UNIT;
		put_le32(answer + len, info.unit);
		len += SDO_ENTRY_UNIT_BYTES;
	}
	return len + put_text(answer + len, info.text, capacity - len);
}

size_t coe_information_answer(const struct coe_dictionary *d, const uint8_t *request,
			      size_t request_len, uint8_t *answer, size_t capacity)
{
	if (request_len <= SDO_INFORMATION_OPCODE_AT) {
		return 0;
	}
	if (d->text == NULL || request_len < BODY_AT + SDO_GET_OBJECT_BYTES) {
		return refuse(request, COE_ABORT_ACCESS, answer);
	}
	switch (request[SDO_INFORMATION_OPCODE_AT] & SDO_INFORMATION_OPCODE_MASK) {
	case SDO_GET_LIST:
		return answer_list(d, request, answer, capacity);
	case SDO_GET_OBJECT:
		return answer_object(d, request, answer, capacity);
	case SDO_GET_ENTRY:
		return request_len < BODY_AT + SDO_GET_ENTRY_BYTES
			       ? 0
			       : answer_entry(d, request, answer, capacity);
	default: /* seven bits of the wire */
		return refuse(request, COE_ABORT_ACCESS, answer);
	}
}
