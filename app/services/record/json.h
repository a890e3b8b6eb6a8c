/* SPDX-License-Identifier: MIT */
/* Text into JSON. Context: blocking (stdio). */
#ifndef RECORD_JSON_H
#define RECORD_JSON_H

#include <stddef.h>
#include <stdio.h>

/** @text (@len bytes, up to a zero) as a JSON string with its quotes; what is not UTF-8 becomes
 * U+FFFD. */
void json_string_n(FILE *out, const char *text, size_t len);
void json_string(FILE *out, const char *text);
/** The shortest text that reads back as @value; null for what JSON cannot represent. */
void json_real(FILE *out, double value);
/** The same as text, "nan" and "inf" included. Returns its length as snprintf does. */
int real_format(double value, char *buf, size_t buf_len);

#endif
