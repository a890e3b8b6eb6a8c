/* SPDX-License-Identifier: MIT */
#include "program/error.h"

#include <stdio.h>

enum { TEXT_BYTES = 1024 };

void error_vprint(const char *prefix, const char *format, va_list args)
{
	char text[TEXT_BYTES];

	vsnprintf(text, sizeof(text), format, args);
	for (char *p = text; *p != '\0'; p++) {
		if ((unsigned char)*p < 0x20 || *p == 0x7f) {
			*p = '?';
		}
	}
	fflush(stdout);
	fprintf(stderr, "%s: %s\n", prefix, text);
}

void error_print(const char *prefix, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	error_vprint(prefix, format, args);
	va_end(args);
}
