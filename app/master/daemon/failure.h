/* SPDX-License-Identifier: MIT */
/* Why something did not work: one line "what: why", and how ecdaqd ends for it. Context: any. */
#ifndef DAEMON_FAILURE_H
#define DAEMON_FAILURE_H

#include "daemon/exit_code.h"

enum { FAILURE_TEXT_BYTES = 320 };

struct failure {
	enum exit_code code;
	char text[FAILURE_TEXT_BYTES];
};

/** Fill @failure and return @result, which is a negative errno. */
int failure_set(struct failure *failure, enum exit_code code, int result, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

#endif
