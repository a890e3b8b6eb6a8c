/* SPDX-License-Identifier: MIT */
/*
 * JSON, written as it goes: one value a line, no spaces to parse around. Integers are exact at 64
 * bits, floats are the shortest text that reads back the same; what JSON has no number for (NaN,
 * infinity) is null. Text that is not UTF-8 (names in a slave's SII) comes out with U+FFFD in place
 * of the wrong bytes. Context: blocking.
 */
#ifndef PROGRAM_JSON_H
#define PROGRAM_JSON_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

struct json {
	FILE *out;
	int depth;
	int needs_comma;
};

void json_init(struct json *js, FILE *out);
/** Ends the line. Every object and array must have been closed. */
void json_end_line(struct json *js);

/* In an object every value has a @key; in an array, and for the outermost value, @key is NULL. */
void json_object_begin(struct json *js, const char *key);
void json_object_end(struct json *js);
void json_array_begin(struct json *js, const char *key);
void json_array_end(struct json *js);
void json_text(struct json *js, const char *key, const char *value);
void json_u64(struct json *js, const char *key, uint64_t value);
void json_i64(struct json *js, const char *key, int64_t value);
void json_double(struct json *js, const char *key, double value);
/** With so many digits after the point. */
void json_fixed(struct json *js, const char *key, double value, int decimals);
void json_truth(struct json *js, const char *key, int value);
void json_null(struct json *js, const char *key);

/* Single values, for text that is no JSON as a whole or has its own layout. */

/** @text as a JSON string with its quotes; the second: @len bytes of it, up to a zero. */
void json_put_text(FILE *out, const char *text);
void json_put_text_n(FILE *out, const char *text, size_t len);
/** The shortest text that reads back as @value; null for what JSON has no number for. */
void json_put_real(FILE *out, double value);
/** The same as text, "nan" and "inf" included. Returns its length as snprintf() does. */
int json_real_format(double value, char *buf, size_t buf_len);

#endif
