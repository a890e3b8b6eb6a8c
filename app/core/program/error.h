/* SPDX-License-Identifier: MIT */
/* How a program reports an error: one line "PROGRAM: object: problem" on standard error. */
#ifndef PROGRAM_ERROR_H
#define PROGRAM_ERROR_H

#include <stdarg.h>

/** "PREFIX: ..." as one line: control characters become '?'. Flushes standard output first, so that
 * the order of both is kept. Context: blocking. */
void error_print(const char *prefix, const char *format, ...) __attribute__((format(printf, 2, 3)));
void error_vprint(const char *prefix, const char *format, va_list args)
	__attribute__((format(printf, 2, 0)));

#endif
