/* SPDX-License-Identifier: MIT */
#include "cli/hex.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BYTES_PER_LINE = 16 };

void hex_format(const uint8_t *bytes, size_t len, char *buf, size_t buf_len)
{
	size_t used = 0;

	buf[0] = '\0';
	for (size_t i = 0; i < len && 3 * i + 3 <= buf_len; i++) {
		used += (size_t)snprintf(buf + used, buf_len - used, i == 0 ? "%02x" : " %02x",
					 bytes[i]);
	}
}

void hex_dump(const uint8_t *bytes, size_t len, uint32_t start)
{
	char text[3 * BYTES_PER_LINE];

	for (size_t i = 0; i < len; i += BYTES_PER_LINE) {
		size_t n = len - i < BYTES_PER_LINE ? len - i : BYTES_PER_LINE;

		hex_format(bytes + i, n, text, sizeof(text));
		printf("0x%04" PRIx32 "  %s\n", start + (uint32_t)i, text);
	}
}

static unsigned digit_of(char c)
{
	return isdigit((unsigned char)c) ? (unsigned)(c - '0')
					 : (unsigned)(tolower((unsigned char)c) - 'a' + 10);
}

ssize_t hex_parse(const char *text, uint8_t *ret_bytes, size_t capacity)
{
	size_t len = 0;

	for (const char *p = text; *p != '\0'; p += 2) {
		p += strspn(p, " ");
		if (*p == '\0') {
			break;
		}
		if (!isxdigit((unsigned char)p[0]) || !isxdigit((unsigned char)p[1]) ||
		    len == capacity) {
			return -EINVAL;
		}
		ret_bytes[len++] = (uint8_t)(digit_of(p[0]) << 4 | digit_of(p[1]));
	}
	return (ssize_t)len;
}

int hex_number(const char *text, uint32_t high, uint32_t *ret_value)
{
	int is_hex = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
	unsigned long value;
	char *end;

	if (!isdigit((unsigned char)text[0])) {
		return -EINVAL;
	}
	errno = 0;
	value = strtoul(text, &end, is_hex ? 16 : 10);
	if (*end != '\0' || errno != 0 || value > high) {
		return -EINVAL;
	}
	*ret_value = (uint32_t)value;
	return 0;
}
