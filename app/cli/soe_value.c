/* SPDX-License-Identifier: MIT */
#include "cli/soe_value.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "config/sdo_value.h"
#include "wire/soe.h"

enum { DIGITS_MAX = 24 };

static enum soe_format format_of(uint32_t attribute)
{
	return (enum soe_format)(attribute >> SOE_FORMAT_SHIFT & SOE_FORMAT_MASK);
}

/* Decimal places of a number that has them. */
static unsigned decimals_of(uint32_t attribute)
{
	enum soe_format format = format_of(attribute);

	return format == SOE_FORMAT_UNSIGNED || format == SOE_FORMAT_SIGNED
		       ? attribute >> SOE_DECIMALS_SHIFT & SOE_DECIMALS_MASK
		       : 0;
}

/* The type whose text an item is; -1: it has a form of its own. */
static int type_of(uint32_t attribute)
{
	static const int8_t types[3][9] = {
		[0] = { [1] = SDO_USINT, [2] = SDO_UINT, [4] = SDO_UDINT, [8] = SDO_ULINT },
		[1] = { [1] = SDO_SINT, [2] = SDO_INT, [4] = SDO_DINT, [8] = SDO_LINT },
		[2] = { [4] = SDO_REAL, [8] = SDO_LREAL },
	};
	size_t bytes = soe_value_bytes(attribute);

	switch (format_of(attribute)) {
	case SOE_FORMAT_SIGNED:
		return types[1][bytes];
	case SOE_FORMAT_FLOAT:
		return bytes >= 4 ? types[2][bytes] : types[0][bytes];
	case SOE_FORMAT_UNSIGNED:
	case SOE_FORMAT_TEXT:
		return types[0][bytes];
	case SOE_FORMAT_BINARY:
	case SOE_FORMAT_HEX:
	case SOE_FORMAT_IDN:
		break;
	}
	return -1;
}

int soe_is_text(uint32_t attribute)
{
	return format_of(attribute) == SOE_FORMAT_TEXT && soe_is_list(attribute) &&
	       soe_value_bytes(attribute) == 1;
}

void soe_attribute_format(uint32_t attribute, char *buf, size_t buf_len)
{
	static const char *const formats[] = { "binary", "unsigned", "signed", "hex",
					       "text",   "IDN",      "float",  "format 7" };
	unsigned decimals = decimals_of(attribute);
	size_t bytes = soe_value_bytes(attribute);
	int used = snprintf(buf, buf_len, "%s%zu byte%s, %s%s",
			    soe_is_list(attribute) ? "list of " : "", bytes, bytes == 1 ? "" : "s",
			    formats[attribute >> SOE_FORMAT_SHIFT & SOE_FORMAT_MASK],
			    (attribute & SOE_IS_COMMAND) != 0 ? ", procedure command" : "");

	if (decimals > 0 && used > 0 && (size_t)used < buf_len) {
		snprintf(buf + used, buf_len - (size_t)used, ", %u decimal place%s", decimals,
			 decimals == 1 ? "" : "s");
	}
}

const uint8_t *soe_list_data(const uint8_t *bytes, size_t len, size_t *ret_len)
{
	size_t stated = len >= SOE_LIST_HEADER_BYTES ? get_le16(bytes) : 0;
	size_t room = len >= SOE_LIST_HEADER_BYTES ? len - SOE_LIST_HEADER_BYTES : 0;

	*ret_len = stated < room ? stated : room;
	return *ret_len > 0 ? bytes + SOE_LIST_HEADER_BYTES : bytes;
}

static uint64_t bits_of(uint32_t attribute, const uint8_t *bytes)
{
	uint8_t padded[8] = { 0 };

	memcpy(padded, bytes, soe_value_bytes(attribute));
	return get_le64(padded);
}

/* "-1234" with two decimal places: "-12.34". */
static void put_point(char *text, size_t text_bytes, unsigned decimals)
{
	char digits[SOE_ITEM_BYTES];
	const char *sign = text[0] == '-' ? "-" : "";
	size_t len;

	snprintf(digits, sizeof(digits), "%0*" PRIu64, (int)decimals + 1,
		 (uint64_t)strtoull(text + strlen(sign), NULL, 10));
	len = strlen(digits) - decimals;
	snprintf(text, text_bytes, "%s%.*s.%s", sign, (int)len, digits, digits + len);
}

void soe_item_format(uint32_t attribute, const uint8_t *bytes, char ret_text[SOE_ITEM_BYTES])
{
	uint64_t bits = bits_of(attribute, bytes);
	int type = type_of(attribute);

	if (type >= 0) {
		sdo_value_format((enum sdo_type)type, bits, ret_text, SOE_ITEM_BYTES);
		if (decimals_of(attribute) > 0) {
			put_point(ret_text, SOE_ITEM_BYTES, decimals_of(attribute));
		}
	} else if (format_of(attribute) == SOE_FORMAT_IDN) {
		soe_idn_format((uint16_t)bits, ret_text);
	} else {
		snprintf(ret_text, SOE_ITEM_BYTES, "0x%0*" PRIx64,
			 (int)(2 * soe_value_bytes(attribute)), bits);
	}
}

void soe_item_json(struct json *js, const char *key, uint32_t attribute, const uint8_t *bytes)
{
	uint64_t bits = bits_of(attribute, bytes);
	int type = type_of(attribute);
	char text[SOE_ITEM_BYTES];

	soe_item_format(attribute, bytes, text);
	if (format_of(attribute) == SOE_FORMAT_IDN) {
		json_text(js, key, text);
	} else if (decimals_of(attribute) > 0) {
		json_fixed(js, key, strtod(text, NULL), (int)decimals_of(attribute));
	} else if (type == SDO_REAL || type == SDO_LREAL) {
		json_double(js, key, strtod(text, NULL));
	} else if (format_of(attribute) == SOE_FORMAT_SIGNED) {
		json_i64(js, key, strtoll(text, NULL, 10));
	} else {
		json_u64(js, key, bits);
	}
}

/* --- from text --- */

/* "-12.5" with two decimal places: "-1250". */
static int take_point(const char *text, unsigned decimals, char *ret_digits)
{
	const char *point = strchr(text, '.');
	size_t whole = point == NULL ? strlen(text) : (size_t)(point - text);
	size_t places = point == NULL ? 0 : strlen(point + 1);

	if (places > decimals || whole + decimals >= DIGITS_MAX) {
		return -EINVAL;
	}
	memcpy(ret_digits, text, whole);
	memset(ret_digits + whole, '0', decimals);
	if (places > 0) {
		memcpy(ret_digits + whole, point + 1, places);
	}
	ret_digits[whole + decimals] = '\0';
	return 0;
}

static int parse_bits(uint32_t attribute, const char *text, uint64_t *ret_bits)
{
	static const enum sdo_type bare[] = {
		[1] = SDO_USINT, [2] = SDO_UINT, [4] = SDO_UDINT, [8] = SDO_ULINT
	};
	int type = type_of(attribute);
	int is_hex = text[0] == '0' && tolower((unsigned char)text[1]) == 'x';
	char digits[DIGITS_MAX];
	uint16_t idn;

	if (format_of(attribute) == SOE_FORMAT_IDN) {
		int r = soe_idn_parse(text, &idn);

		*ret_bits = r == 0 ? idn : 0;
		return r;
	}
	if (type < 0) {
		type = (int)bare[soe_value_bytes(attribute)];
	}
	if (decimals_of(attribute) > 0 && !is_hex) {
		if (take_point(text, decimals_of(attribute), digits) < 0) {
			return -EINVAL;
		}
		text = digits;
	}
	return sdo_value_parse((enum sdo_type)type, text, ret_bits);
}

/* The number up to a comma or the end, to @ret_bytes. Characters taken, or -errno. */
static int parse_item(uint32_t attribute, const char *text, uint8_t *ret_bytes)
{
	size_t len = strcspn(text, ",");
	uint8_t bytes[8];
	char word[SOE_ITEM_BYTES];
	uint64_t bits = 0;
	int r;

	if (len >= sizeof(word)) {
		return -EINVAL;
	}
	memcpy(word, text, len);
	word[len] = '\0';
	r = parse_bits(attribute, word, &bits);
	if (r < 0) {
		return r;
	}
	put_le64(bytes, bits);
	memcpy(ret_bytes, bytes, soe_value_bytes(attribute));
	return (int)len;
}

/* What follows the header. */
static int parse_list(uint32_t attribute, const char *text, uint8_t *ret_bytes)
{
	size_t item_bytes = soe_value_bytes(attribute);
	size_t len = 0;

	if (soe_is_text(attribute)) {
		len = strlen(text);
		memcpy(ret_bytes, text, len);
		return (int)len;
	}
	while (*text != '\0') {
		int taken = parse_item(attribute, text, ret_bytes + len);

		if (taken < 0) {
			return taken;
		}
		len += item_bytes;
		text += taken;
		if (*text == ',') {
			text++;
			if (*text == '\0') {
				return -EINVAL;
			}
		}
	}
	return (int)len;
}

int soe_value_parse(uint32_t attribute, const char *text, uint8_t *ret_bytes, size_t capacity)
{
	int len;

	if (soe_value_bytes(attribute) == 0 ||
	    capacity < SOE_LIST_HEADER_BYTES + 8 * strlen(text)) {
		return -EINVAL;
	}
	if (!soe_is_list(attribute)) {
		len = parse_item(attribute, text, ret_bytes);
		return len < 0                        ? len
		       : text[len] == '\0' && len > 0 ? (int)soe_value_bytes(attribute)
						      : -EINVAL;
	}
	len = parse_list(attribute, text, ret_bytes + SOE_LIST_HEADER_BYTES);
	if (len > UINT16_MAX) {
		return -ERANGE;
	}
	if (len >= 0) {
		put_le16(ret_bytes, (uint16_t)len);
		put_le16(ret_bytes + 2, (uint16_t)len);
	}
	return len < 0 ? len : SOE_LIST_HEADER_BYTES + len;
}
