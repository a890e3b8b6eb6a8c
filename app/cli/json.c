/* SPDX-License-Identifier: MIT */
#include "cli/json.h"

#include <assert.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

/* Bytes of the UTF-8 sequence at @p, by RFC 3629: no overlong forms, no surrogates. 0: not one. */
static unsigned utf8_length(const unsigned char *p)
{
	unsigned length;
	uint32_t code;

	if (p[0] < 0x80) {
		return 1;
	}
	if (p[0] < 0xc2 || p[0] > 0xf4) {
		return 0;
	}
	length = p[0] < 0xe0 ? 2 : p[0] < 0xf0 ? 3 : 4;
	code = p[0] & (0x7fu >> length);
	for (unsigned i = 1; i < length; i++) {
		if ((p[i] & 0xc0) != 0x80) {
			return 0; /* the closing zero is no continuation, either */
		}
		code = code << 6 | (p[i] & 0x3fu);
	}
	if ((length == 3 && (code < 0x800 || (code >= 0xd800 && code <= 0xdfff))) ||
	    (length == 4 && (code < 0x10000 || code > 0x10ffff))) {
		return 0;
	}
	return length;
}

static void write_text(FILE *out, const char *text)
{
	const unsigned char *p = (const unsigned char *)text;

	fputc('"', out);
	while (*p != '\0') {
		unsigned length = utf8_length(p);

		if (length == 0) {
			fputs("\\ufffd", out);
			p++;
		} else if (*p == '"' || *p == '\\') {
			fprintf(out, "\\%c", *p++);
		} else if (*p == '\n') {
			fputs("\\n", out);
			p++;
		} else if (*p == '\t') {
			fputs("\\t", out);
			p++;
		} else if (*p < 0x20 || *p == 0x7f) {
			fprintf(out, "\\u%04x", *p++);
		} else {
			fwrite(p, 1, length, out);
			p += length;
		}
	}
	fputc('"', out);
}

static void lead(struct json *js, const char *key)
{
	if (js->needs_comma) {
		fputc(',', js->out);
	}
	js->needs_comma = 1;
	if (key != NULL) {
		write_text(js->out, key);
		fputc(':', js->out);
	}
}

static void begin(struct json *js, const char *key, char bracket)
{
	lead(js, key);
	fputc(bracket, js->out);
	js->depth++;
	js->needs_comma = 0;
}

static void end(struct json *js, char bracket)
{
	assert(js->depth > 0);
	fputc(bracket, js->out);
	js->depth--;
	js->needs_comma = 1;
}

void json_init(struct json *js, FILE *out)
{
	*js = (struct json){ .out = out };
}

void json_end_line(struct json *js)
{
	assert(js->depth == 0);
	fputc('\n', js->out);
	js->needs_comma = 0;
}

void json_object_begin(struct json *js, const char *key)
{
	begin(js, key, '{');
}

void json_object_end(struct json *js)
{
	end(js, '}');
}

void json_array_begin(struct json *js, const char *key)
{
	begin(js, key, '[');
}

void json_array_end(struct json *js)
{
	end(js, ']');
}

void json_text(struct json *js, const char *key, const char *value)
{
	lead(js, key);
	write_text(js->out, value);
}

void json_u64(struct json *js, const char *key, uint64_t value)
{
	lead(js, key);
	fprintf(js->out, "%" PRIu64, value);
}

void json_i64(struct json *js, const char *key, int64_t value)
{
	lead(js, key);
	fprintf(js->out, "%" PRId64, value);
}

void json_double(struct json *js, const char *key, double value)
{
	char text[32];

	if (!isfinite(value)) {
		json_null(js, key);
		return;
	}
	lead(js, key);
	for (int digits = 15; digits <= 17; digits++) {
		snprintf(text, sizeof(text), "%.*g", digits, value);
		if (strtod(text, NULL) == value) {
			break;
		}
	}
	fputs(text, js->out);
}

void json_truth(struct json *js, const char *key, int value)
{
	lead(js, key);
	fputs(value ? "true" : "false", js->out);
}

void json_null(struct json *js, const char *key)
{
	lead(js, key);
	fputs("null", js->out);
}
