/* SPDX-License-Identifier: MIT */
#include "wire/soe.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"

enum { OPERATION = 0x07, MORE = 0x08, ERROR = 0x10, DRIVE_SHIFT = 5 };

int soe_parse(const uint8_t *data, size_t data_len, struct soe_message *ret)
{
	struct soe_message m = { .operation = 0 };

	if (data_len < SOE_HEADER_BYTES) {
		return -EBADMSG;
	}
	m.operation = data[0] & OPERATION;
	m.has_more = (data[0] & MORE) != 0;
	m.is_error = (data[0] & ERROR) != 0;
	m.drive = data[0] >> DRIVE_SHIFT;
	m.elements = data[1];
	if (m.has_more) {
		m.fragments_left = get_le16(data + 2);
	} else {
		m.idn = get_le16(data + 2);
	}
	m.body = data + SOE_HEADER_BYTES;
	m.body_len = data_len - SOE_HEADER_BYTES;
	if (m.operation < SOE_READ || m.operation > SOE_EMERGENCY ||
	    (m.is_error && m.body_len < SOE_ERROR_BYTES)) {
		return -EBADMSG;
	}
	*ret = m;
	return 0;
}

size_t soe_format(const struct soe_message *m, uint8_t *data, size_t capacity)
{
	if (capacity < SOE_HEADER_BYTES || m->body_len > capacity - SOE_HEADER_BYTES) {
		return 0;
	}
	data[0] = (uint8_t)((m->operation & OPERATION) | (m->has_more ? MORE : 0) |
			    (m->is_error ? ERROR : 0) | m->drive << DRIVE_SHIFT);
	data[1] = m->elements;
	put_le16(data + 2, m->has_more ? m->fragments_left : m->idn);
	if (m->body_len > 0) {
		memcpy(data + SOE_HEADER_BYTES, m->body, m->body_len);
	}
	return SOE_HEADER_BYTES + m->body_len;
}

const char *soe_error_to_str(uint32_t code)
{
	static const struct {
		uint16_t code;
		const char *text;
	} texts[] = {
		{ SOE_ERROR_NO_IDN, "no such IDN" },
		{ SOE_ERROR_NO_ELEMENT, "invalid access to an element" },
		{ SOE_ERROR_TOO_SHORT, "value too short" },
		{ SOE_ERROR_TOO_LONG, "value too long" },
		{ SOE_ERROR_READ_ONLY, "value cannot be changed" },
		{ SOE_ERROR_BELOW_MIN, "value below its minimum" },
		{ SOE_ERROR_ABOVE_MAX, "value above its maximum" },
		{ SOE_ERROR_INVALID, "invalid value" },
	};

	for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++) {
		if (texts[i].code == code) {
			return texts[i].text;
		}
	}
	return "unknown error";
}

size_t soe_value_bytes(uint32_t attribute)
{
	static const uint8_t bytes[] = { 0, 2, 4, 8, 1, 2, 4, 8 };

	return bytes[attribute >> SOE_LENGTH_SHIFT & SOE_LENGTH_MASK];
}

int soe_is_list(uint32_t attribute)
{
	return (attribute >> SOE_LENGTH_SHIFT & SOE_LENGTH_MASK) >= SOE_LENGTH_LIST_1;
}
