/* SPDX-License-Identifier: MIT */
#include "base/utf8.h"

#include <stdint.h>
#include <string.h>

size_t utf8_len(const char *text, size_t left)
{
	const uint8_t *p = (const uint8_t *)text;
	size_t len = p[0] < 0x80                   ? 1
		     : p[0] >= 0xc2 && p[0] < 0xe0 ? 2
		     : (p[0] & 0xf0) == 0xe0       ? 3
		     : p[0] >= 0xf0 && p[0] < 0xf5 ? 4
						   : 0;

	if (len == 0 || len > left) {
		return 0;
	}
	for (size_t i = 1; i < len; i++) {
		if ((p[i] & 0xc0) != 0x80) {
			return 0;
		}
	}
	if ((p[0] == 0xe0 && p[1] < 0xa0) || (p[0] == 0xed && p[1] > 0x9f) ||
	    (p[0] == 0xf0 && p[1] < 0x90) || (p[0] == 0xf4 && p[1] > 0x8f)) {
		return 0; /* overlong, surrogate, beyond U+10FFFF */
	}
	return len;
}

void utf8_copy(const char *text, char *buf, size_t buf_len)
{
	size_t left = strlen(text);
	size_t used = 0;

	while (left > 0) {
		size_t n = utf8_len(text, left);
		const char *from = n > 0 ? text : UTF8_REPLACEMENT;
		size_t bytes = n > 0 ? n : strlen(UTF8_REPLACEMENT);

		if (bytes >= buf_len - used) {
			break;
		}
		memcpy(buf + used, from, bytes);
		used += bytes;
		n = n > 0 ? n : 1;
		text += n;
		left -= n;
	}
	buf[used] = '\0';
}
