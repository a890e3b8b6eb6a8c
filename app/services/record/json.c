/* SPDX-License-Identifier: MIT */
#include "record/json.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Length of the UTF-8 sequence at @p, 0 if it is none. */
static size_t utf8_len(const unsigned char *p, size_t left)
{
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

void json_string_n(FILE *out, const char *text, size_t len)
{
	const unsigned char *p = (const unsigned char *)text;
	size_t i = 0;

	fputc('"', out);
	while (i < len && p[i] != '\0') {
		size_t n = utf8_len(p + i, len - i);

		if (n == 0) {
			fputs("\xef\xbf\xbd", out);
			n = 1;
		} else if (p[i] == '"' || p[i] == '\\') {
			fprintf(out, "\\%c", p[i]);
		} else if (p[i] < 0x20 || p[i] == 0x7f) {
			fprintf(out, "\\u%04x", p[i]);
		} else {
			fwrite(p + i, 1, n, out);
		}
		i += n;
	}
	fputc('"', out);
}

void json_string(FILE *out, const char *text)
{
	json_string_n(out, text, strlen(text));
}

int real_format(double value, char *buf, size_t buf_len)
{
	int n = 0;

	for (int digits = 15; digits <= 17; digits++) {
		n = snprintf(buf, buf_len, "%.*g", digits, value);
		if (isnan(value) || strtod(buf, NULL) == value) {
			break;
		}
	}
	return n;
}

void json_real(FILE *out, double value)
{
	char text[40];

	if (!isfinite(value)) {
		fputs("null", out);
		return;
	}
	real_format(value, text, sizeof(text));
	fputs(text, out);
}
