/* SPDX-License-Identifier: MIT */
#include "devices/coe_information.h"

#include <string.h>

#include "base/bytes.h"

enum information_opcode {
	GET_LIST = 1,
	LIST = 2,
	GET_OBJECT = 3,
	OBJECT = 4,
	GET_ENTRY = 5,
	ENTRY = 6,
	ERROR = 7,
};

enum layout {
	OPCODE_AT = 2, /* behind the CoE header; then one byte reserved and two of fragments left */
	BODY_AT = 6,
	ERROR_BYTES = 10,
	LIST_REQUEST_BYTES = 8,
	ENTRY_REQUEST_BYTES = 10,
	OBJECT_BYTES = 12,
	ENTRY_BYTES = 16,
};

enum list_type { LIST_LENGTHS = 0, LIST_ALL = 1, LIST_TYPES = 5 };

enum object_code { OBJECT_VARIABLE = 7, OBJECT_RECORD = 9 };

enum { ACCESS_READ = 0x0007 }; /* in PRE-OP, SAFE-OP and OP */

static void put_header(const uint8_t *request, enum information_opcode opcode, uint8_t *answer)
{
	memcpy(answer, request, 2);
	answer[OPCODE_AT] = (uint8_t)opcode;
	memset(answer + OPCODE_AT + 1, 0, 3); /* no fragments follow */
}

static size_t refuse(const uint8_t *request, enum coe_abort code, uint8_t *answer)
{
	put_header(request, ERROR, answer);
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
	put_header(request, LIST, answer);
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
	if (code != COE_OK || capacity < OBJECT_BYTES) {
		return refuse(request, code != COE_OK ? code : COE_ABORT_ACCESS, answer);
	}
	put_header(request, OBJECT, answer);
	put_le16(answer + BODY_AT, index);
	put_le16(answer + BODY_AT + 2, is_record ? 0 : info.data_type);
	answer[BODY_AT + 4] = is_record ? first.bytes[0] : 0;
	answer[BODY_AT + 5] = is_record ? OBJECT_RECORD : OBJECT_VARIABLE;
	return OBJECT_BYTES;
}

static size_t answer_entry(const struct coe_dictionary *d, const uint8_t *request, uint8_t *answer,
			   size_t capacity)
{
	uint16_t index = get_le16(request + BODY_AT);
	uint8_t subindex = request[BODY_AT + 2];
	struct coe_entry_info info;
	enum coe_abort code = coe_dictionary_entry_info(d, index, subindex, &info);

	if (code != COE_OK || capacity < ENTRY_BYTES) {
		return refuse(request, code != COE_OK ? code : COE_ABORT_ACCESS, answer);
	}
	put_header(request, ENTRY, answer);
	put_le16(answer + BODY_AT, index);
	answer[BODY_AT + 2] = subindex;
	answer[BODY_AT + 3] = 0; /* none of the optional values is sent */
	put_le16(answer + BODY_AT + 4, info.data_type);
	put_le16(answer + BODY_AT + 6, info.bit_len);
	put_le16(answer + BODY_AT + 8, ACCESS_READ);
	return ENTRY_BYTES + put_text(answer + ENTRY_BYTES, info.text, capacity - ENTRY_BYTES);
}

size_t coe_information_answer(const struct coe_dictionary *d, const uint8_t *request,
			      size_t request_len, uint8_t *answer, size_t capacity)
{
	if (request_len <= OPCODE_AT) {
		return 0;
	}
	if (d->text == NULL || request_len < LIST_REQUEST_BYTES) {
		return refuse(request, COE_ABORT_ACCESS, answer);
	}
	switch (request[OPCODE_AT] & 0x7f) {
	case GET_LIST:
		return answer_list(d, request, answer, capacity);
	case GET_OBJECT:
		return answer_object(d, request, answer, capacity);
	case GET_ENTRY:
		return request_len < ENTRY_REQUEST_BYTES
			       ? 0
			       : answer_entry(d, request, answer, capacity);
	default: /* seven bits of the wire */
		return refuse(request, COE_ABORT_ACCESS, answer);
	}
}
