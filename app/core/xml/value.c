/* SPDX-License-Identifier: MIT */
#include "xml/value.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/grow.h"
#include "base/utf8.h"

int xml_number(struct xml *xml, const char *what, const char *text, struct xml_range range,
	       int64_t *ret_value)
{
	int is_hex = (text[0] == '#' || text[0] == '0') && (text[1] == 'x' || text[1] == 'X');
	const char *digits = text + (is_hex ? 2 : text[0] == '-' || text[0] == '+');
	char *end;
	long long value;

	errno = 0;
	value = strtoll(is_hex ? digits : text, &end, is_hex ? 16 : 10);
	if (!isxdigit((unsigned char)digits[0]) || *end != '\0') {
		return xml_fail(xml, "%s: \"%.40s\" is no number (#x1F or 31)", what, text);
	}
	if (errno != 0 || value < range.min || value > range.max) {
		return xml_fail(xml, "%s: %.40s is not within %" PRId64 " to %" PRId64, what, text,
				range.min, range.max);
	}
	*ret_value = value;
	return 0;
}

void xml_plain(const char *text, char *ret_text, size_t text_bytes)
{
	size_t len;

	utf8_copy(text, ret_text, text_bytes);
	for (char *p = ret_text; *p != '\0'; p++) {
		if ((unsigned char)*p < 0x20 || *p == 0x7f) {
			*p = ' ';
		}
	}
	/* Cut, it may end in a blank. */
	len = strlen(ret_text);
	while (len > 0 && ret_text[len - 1] == ' ') {
		len--;
	}
	ret_text[len] = '\0';
	memmove(ret_text, ret_text + strspn(ret_text, " "), len + 1 - strspn(ret_text, " "));
}

static int digit(char c)
{
	if (!isxdigit((unsigned char)c)) {
		return -1;
	}
	return isdigit((unsigned char)c) ? c - '0' : tolower((unsigned char)c) - 'a' + 10;
}

int xml_octets(struct xml *xml, const char *text, size_t limit, uint8_t **data, size_t *ret_len)
{
	size_t len = strlen(text);
	uint8_t *octets;

	if (len % 2 != 0 || strspn(text, "0123456789abcdefABCDEF") != len) {
		return xml_fail(xml, "Data: \"%.40s\" is no row of hexadecimal octets", text);
	}
	if (len / 2 > limit) {
		return xml_fail(xml, "Data: more than %zu octets", limit);
	}
	octets = malloc(len / 2 + 1);
	if (octets == NULL) {
		return xml_fail(xml, "out of memory");
	}
	for (size_t i = 0; i < len / 2; i++) {
		octets[i] = (uint8_t)(digit(text[2 * i]) << 4 | digit(text[2 * i + 1]));
	}
	free(*data);
	*data = octets;
	*ret_len = len / 2;
	return 0;
}

void *xml_grow(struct xml *xml, void *array, size_t *count, size_t bytes, struct xml_limit limit)
{
	void *grown = *count == limit.rows ? NULL : array_grow(array, count, bytes);

	if (grown == NULL && xml != NULL && *count == limit.rows) {
		xml_fail(xml, "more than %zu %s", limit.rows, limit.what);
	} else if (grown == NULL && xml != NULL) {
		xml_fail(xml, "out of memory");
	}
	return grown;
}
