/* SPDX-License-Identifier: MIT */
/* Why something failed: one line "what: why", and the exit code of ecdaqd for it. Context: any. */
#ifndef DAEMON_FAILURE_H
#define DAEMON_FAILURE_H

#include "program/exit_code.h"

enum { FAILURE_TEXT_BYTES = 320 };

struct failure {
	enum exit_code code;
	char text[FAILURE_TEXT_BYTES];
};

/** Fill @failure and return @result, which is a negative errno. */
int failure_set(struct failure *failure, enum exit_code code, int result, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

/** 1 if the same attempt may succeed later (no slave yet), so that it is repeated. */
int failure_is_transient(enum exit_code code);

/** The code for a call of bus/bus.h that failed with @r; @otherwise for a state or lock not
 * reached. */
enum exit_code failure_code_of_bus(int r, enum exit_code otherwise);

#endif
