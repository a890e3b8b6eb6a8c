/* SPDX-License-Identifier: MIT */
#include "program/json.h"

#include <assert.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/utf8.h"

void json_put_text_n(FILE *out, const char *text, size_t len)
{
	const unsigned char *p = (const unsigned char *)text;
	size_t i = 0;

	fputc('"', out);
	while (i < len && p[i] != '\0') {
		size_t n = utf8_len(text + i, len - i);

		if (n == 0) {
			fputs(UTF8_REPLACEMENT, out);
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

void json_put_text(FILE *out, const char *text)
{
	json_put_text_n(out, text, strlen(text));
}

int json_real_format(double value, char *buf, size_t buf_len)
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

void json_put_real(FILE *out, double value)
{
	char text[40];

	if (!isfinite(value)) {
		fputs("null", out);
		return;
	}
	json_real_format(value, text, sizeof(text));
	fputs(text, out);
}

static void lead(struct json *js, const char *key)
{
	if (js->needs_comma) {
		fputc(',', js->out);
	}
	js->needs_comma = 1;
	if (key != NULL) {
		json_put_text(js->out, key);
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
	json_put_text(js->out, value);
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
	lead(js, key);
	json_put_real(js->out, value);
}

void json_fixed(struct json *js, const char *key, double value, int decimals)
{
	lead(js, key);
	if (isfinite(value)) {
		fprintf(js->out, "%.*f", decimals, value);
	} else {
		fputs("null", js->out);
	}
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
