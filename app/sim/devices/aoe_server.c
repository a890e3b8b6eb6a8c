/* SPDX-License-Identifier: MIT */
#include "devices/aoe_server.h"

#include <string.h>

#include "base/bytes.h"
#include "devices/coe_dictionary.h"
#include "wire/aoe.h"

enum { ANSWER_MIN = AOE_HEADER_BYTES + AOE_READ_ANSWER_BYTES + COE_VALUE_BYTES };

/* One command: what is asked of which object. */
struct command {
	uint16_t index;
	uint8_t subindex;
	uint32_t len;
};

static uint32_t take_command(const uint8_t *data, const struct aoe_header *h, struct command *ret)
{
	uint32_t offset;

	if (h->data_len < AOE_READ_BYTES) {
		return AOE_ERROR_SIZE;
	}
	if (get_le32(data) != AOE_GROUP_SDO) {
		return AOE_ERROR_GROUP;
	}
	offset = get_le32(data + 4);
	*ret = (struct command){ .index = (uint16_t)(offset >> 16),
				 .subindex = (uint8_t)offset,
				 .len = get_le32(data + 8) };
	return offset & AOE_OFFSET_COMPLETE ? AOE_ERROR_SERVICE : 0;
}

static size_t read_object(const struct coe_dictionary *d, const uint8_t *data,
			  const struct aoe_header *h, uint8_t *answer)
{
	struct command c = { .index = 0 };
	struct coe_value v = { .len = 0 };
	uint32_t result = take_command(data, h, &c);

	if (result == 0) {
		result = (uint32_t)coe_dictionary_read(d, c.index, c.subindex, &v);
	}
	if (result == 0 && v.len > c.len) {
		result = AOE_ERROR_SIZE;
	}
	if (result != 0) {
		v.len = 0;
	}
	put_le32(answer, result);
	put_le32(answer + 4, (uint32_t)v.len);
	memcpy(answer + AOE_READ_ANSWER_BYTES, v.bytes, v.len);
	return AOE_READ_ANSWER_BYTES + v.len;
}

static size_t write_object(struct coe_dictionary *d, const uint8_t *data,
			   const struct aoe_header *h, uint8_t *answer)
{
	struct command c = { .index = 0 };
	uint32_t result = take_command(data, h, &c);

	if (result == 0 && c.len > h->data_len - AOE_WRITE_BYTES) {
		result = AOE_ERROR_SIZE;
	}
	if (result == 0) {
		result = (uint32_t)coe_dictionary_write(d, c.index, c.subindex,
							data + AOE_WRITE_BYTES, c.len);
	}
	put_le32(answer, result);
	return AOE_WRITE_ANSWER_BYTES;
}

size_t aoe_server_answer(void *ctx, const struct mailbox_call *call)
{
	const uint8_t *data = call->request + AOE_HEADER_BYTES;
	uint8_t *answer = call->answer + AOE_HEADER_BYTES;
	struct aoe_header h;
	struct aoe_header back;

	if (call->capacity < ANSWER_MIN ||
	    aoe_header_get(call->request, call->request_len, &h) < 0) {
		return 0;
	}
	back = h;
	back.target = h.source;
	back.source = h.target;
	back.flags = AOE_FLAG_RESPONSE | AOE_FLAG_COMMAND;
	back.data_len = 0;
	if (h.command == AOE_READ) {
		back.data_len = (uint32_t)read_object(ctx, data, &h, answer);
	} else if (h.command == AOE_WRITE) {
		back.data_len = (uint32_t)write_object(ctx, data, &h, answer);
	} else {
		back.error = AOE_ERROR_SERVICE;
	}
	aoe_header_put(call->answer, &back);
	return AOE_HEADER_BYTES + back.data_len;
}
