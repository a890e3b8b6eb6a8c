/* SPDX-License-Identifier: MIT */
/* SDO information: list of objects, description of an object, of an entry; in fragments. */
#include <errno.h>
#include <string.h>

#include "mailbox/coe.h"
#include "mailbox/coe_internal.h"

/* Of the optional values of an entry that lie before its name only the unit is asked for. */
enum { VALUE_INFO = SDO_VALUE_ACCESS | SDO_VALUE_CATEGORY | SDO_VALUE_MAPPING | SDO_VALUE_UNIT };

static uint8_t opcode_of(const struct mailbox_request *rq)
{
	switch (rq->with.coe.operation) {
	case COE_OBJECT:
		return SDO_GET_OBJECT;
	case COE_ENTRY:
		return SDO_GET_ENTRY;
	case COE_LIST:
	case COE_UPLOAD:
	case COE_DOWNLOAD:
		break;
	}
	return SDO_GET_LIST;
}

int coe_information_compose(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	const struct coe_parameters *with = &rq->with.coe;

	if (capacity < SDO_INFORMATION_BODY_AT + SDO_GET_ENTRY_BYTES) {
		return -EMSGSIZE;
	}
	memset(data, 0, SDO_INFORMATION_BODY_AT + SDO_GET_ENTRY_BYTES);
	put_le16(data, (uint16_t)(COE_SDO_INFORMATION << COE_SERVICE_SHIFT));
	data[SDO_INFORMATION_OPCODE_AT] = opcode_of(rq);
	put_le16(data + SDO_INFORMATION_BODY_AT,
		 with->operation == COE_LIST ? (uint16_t)with->list_type : with->index);
	if (with->operation != COE_ENTRY) {
		return SDO_INFORMATION_BODY_AT + SDO_GET_OBJECT_BYTES;
	}
	data[SDO_INFORMATION_BODY_AT + 2] = with->subindex;
	data[SDO_INFORMATION_BODY_AT + 3] = VALUE_INFO;
	return SDO_INFORMATION_BODY_AT + SDO_GET_ENTRY_BYTES;
}

/* Does the first fragment answer this request, or an earlier one? */
static int is_of_request(const struct mailbox_request *rq, const uint8_t *body, size_t body_len)
{
	const struct coe_parameters *with = &rq->with.coe;

	if (with->operation == COE_LIST) {
		return get_le16(body) == (uint16_t)with->list_type;
	}
	return get_le16(body) == with->index &&
	       (with->operation != COE_ENTRY || (body_len > 2 && body[2] == with->subindex));
}

static int take_fragment(struct mailbox_request *rq, const uint8_t *body, size_t body_len,
			 uint16_t left)
{
	struct coe_state *st = &rq->state.coe;

	if (body_len > rq->capacity - rq->len) {
		return -EMSGSIZE;
	}
	memcpy(rq->buffer + rq->len, body, body_len);
	rq->len += body_len;
	st->has_fragment = 1;
	st->fragments_left = left;
	return left == 0 ? MAILBOX_DONE : MAILBOX_WAIT;
}

int coe_information_received(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	struct coe_state *st = &rq->state.coe;
	const uint8_t *body = data + SDO_INFORMATION_BODY_AT;
	size_t body_len = len - SDO_INFORMATION_BODY_AT;
	uint8_t opcode = data[SDO_INFORMATION_OPCODE_AT] & SDO_INFORMATION_OPCODE_MASK;
	uint16_t left;

	if (len < SDO_INFORMATION_BODY_AT + SDO_GET_OBJECT_BYTES) {
		return -EPROTO;
	}
	if (opcode == SDO_INFORMATION_ERROR) {
		rq->detail = body_len >= 4 ? get_le32(body) : 0;
		return -EREMOTEIO;
	}
	if (opcode != opcode_of(rq) + 1) {
		return MAILBOX_IGNORE;
	}
	left = get_le16(data + SDO_INFORMATION_FRAGMENTS_AT);
	if (st->has_fragment) {
		/* One lost in between would make a list with a hole. */
		return left + 1 == st->fragments_left ? take_fragment(rq, body, body_len, left)
						      : -EPROTO;
	}
	if (!is_of_request(rq, body, body_len)) {
		return MAILBOX_IGNORE;
	}
	if (rq->with.coe.operation == COE_LIST) {
		body += SDO_GET_OBJECT_BYTES; /* the list's type, in the first fragment only */
		body_len -= SDO_GET_OBJECT_BYTES;
	}
	return take_fragment(rq, body, body_len, left);
}

static void get_name(const uint8_t *text, size_t len, char *ret_name)
{
	size_t n = len < COE_NAME_BYTES - 1 ? len : COE_NAME_BYTES - 1;

	memcpy(ret_name, text, n);
	ret_name[n] = '\0';
}

int coe_object_get(const uint8_t *buffer, size_t len, struct coe_object *ret)
{
	if (len < SDO_OBJECT_BYTES) {
		return -EPROTO;
	}
	*ret = (struct coe_object){ .index = get_le16(buffer),
				    .data_type = get_le16(buffer + 2),
				    .subindex_max = buffer[4],
				    .object_code = buffer[5] };
	get_name(buffer + SDO_OBJECT_BYTES, len - SDO_OBJECT_BYTES, ret->name);
	return 0;
}

/* Does the unit follow? There are slaves that answer that it does, and send the name at once. The
 * last byte of a unit is 0, which no name begins with, and it comes first. */
static int has_unit(const uint8_t *buffer, size_t len)
{
	return (buffer[3] & SDO_VALUE_UNIT) != 0 && len >= SDO_ENTRY_BYTES + SDO_ENTRY_UNIT_BYTES &&
	       buffer[SDO_ENTRY_BYTES] == 0;
}

int coe_entry_get(const uint8_t *buffer, size_t len, struct coe_entry *ret)
{
	size_t name_at = SDO_ENTRY_BYTES;

	if (len < SDO_ENTRY_BYTES) {
		return -EPROTO;
	}
	*ret = (struct coe_entry){ .index = get_le16(buffer),
				   .subindex = buffer[2],
				   .data_type = get_le16(buffer + 4),
				   .bit_len = get_le16(buffer + 6),
				   .access = get_le16(buffer + 8) };
	if (has_unit(buffer, len)) {
		ret->unit = get_le32(buffer + SDO_ENTRY_BYTES);
		name_at += SDO_ENTRY_UNIT_BYTES;
	}
	get_name(buffer + name_at, len - name_at, ret->name);
	return 0;
}
