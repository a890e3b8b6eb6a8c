/* SPDX-License-Identifier: MIT */
#include "wire/soe.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
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
		{ 0x2001, "no name" },
		{ 0x2002, "name too short" },
		{ 0x2003, "name too long" },
		{ 0x2004, "name cannot be changed" },
		{ 0x2005, "name is write-protected now" },
		{ 0x3002, "attribute too short" },
		{ 0x3003, "attribute too long" },
		{ 0x3004, "attribute cannot be changed" },
		{ 0x3005, "attribute is write-protected now" },
		{ 0x4001, "no unit" },
		{ 0x4002, "unit too short" },
		{ 0x4003, "unit too long" },
		{ 0x4004, "unit cannot be changed" },
		{ 0x4005, "unit is write-protected now" },
		{ 0x5001, "no minimum" },
		{ 0x5002, "minimum too short" },
		{ 0x5003, "minimum too long" },
		{ 0x5004, "minimum cannot be changed" },
		{ 0x5005, "minimum is write-protected now" },
		{ 0x6001, "no maximum" },
		{ 0x6002, "maximum too short" },
		{ 0x6003, "maximum too long" },
		{ 0x6004, "maximum cannot be changed" },
		{ 0x6005, "maximum is write-protected now" },
		{ SOE_ERROR_TOO_SHORT, "value too short" },
		{ SOE_ERROR_TOO_LONG, "value too long" },
		{ SOE_ERROR_READ_ONLY, "value cannot be changed" },
		{ 0x7005, "value is write-protected now" },
		{ SOE_ERROR_BELOW_MIN, "value below its minimum" },
		{ SOE_ERROR_ABOVE_MAX, "value above its maximum" },
		{ SOE_ERROR_INVALID, "invalid value" },
		{ 0x7009, "value is write-protected by a password" },
		{ 0x700a, "value is write-protected now: cyclically configured" },
		{ 0x700b, "invalid indirect addressing" },
		{ 0x700c, "value is write-protected by other settings" },
		{ 0x7010, "procedure command already active" },
		{ 0x7011, "procedure command cannot be interrupted" },
		{ 0x7012, "procedure command cannot be executed now" },
		{ 0x7013, "procedure command cannot be executed: invalid parameters" },
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

void soe_idn_format(uint16_t idn, char ret_text[SOE_IDN_TEXT_BYTES])
{
	snprintf(ret_text, SOE_IDN_TEXT_BYTES, "%c-%u-%04u", (idn & 0x8000) != 0 ? 'P' : 'S',
		 idn >> 12 & 7, idn & 0x0fff);
}

/* The number that begins @text, up to @high; then @text is behind it. -EINVAL: none. */
static long take_number(const char **text, int base, long high)
{
	char *end;
	long number;

	if (!isdigit((unsigned char)**text)) {
		return -EINVAL;
	}
	number = strtol(*text, &end, base);
	*text = end;
	return number <= high ? number : -EINVAL;
}

int soe_idn_parse(const char *text, uint16_t *ret_idn)
{
	int kind = toupper((unsigned char)text[0]);
	int is_hex = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
	long set = 0;
	long number;

	if ((kind == 'S' || kind == 'P') && text[1] == '-') {
		text += 2;
		set = take_number(&text, 10, 7);
		if (set < 0 || *text++ != '-') {
			return -EINVAL;
		}
		number = take_number(&text, 10, 0x0fff);
	} else {
		kind = 'S';
		number = take_number(&text, is_hex ? 16 : 10, UINT16_MAX);
	}
	if (number < 0 || *text != '\0') {
		return -EINVAL;
	}
	*ret_idn = (uint16_t)((kind == 'P' ? 0x8000 : 0) | set << 12 | number);
	return 0;
}
