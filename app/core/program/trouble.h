/* SPDX-License-Identifier: MIT */
/*
 * A service on a server that may be away: a problem is one line until it is another one or over,
 * and the time between attempts grows, with a random half so that not all appliances come back at
 * once. Context: one thread.
 */
#ifndef PROGRAM_TROUBLE_H
#define PROGRAM_TROUBLE_H

#include <stdint.h>

#include "base/prng.h"

enum { TROUBLE_LINE_BYTES = 256 };

struct trouble {
	void (*report)(const char *line);
	int64_t first_ns; /* between attempts, at first and at most */
	int64_t last_ns;
	int64_t backoff_ns;
	int64_t due_ns;                    /* CLOCK_MONOTONIC of the next attempt */
	char reported[TROUBLE_LINE_BYTES]; /* newest problem; "": none */
	struct prng prng;
};

/** @report gets the lines. */
void trouble_init(struct trouble *t, void (*report)(const char *line), int64_t first_ns,
		  int64_t last_ns);
/** 1 if the next attempt is due. */
int trouble_is_due(const struct trouble *t);
/** An attempt has failed: report @problem unless that was the newest, and wait longer. */
void trouble_found(struct trouble *t, const char *problem);
/** An attempt has succeeded. 1 if there was a problem, whose end the caller reports. */
int trouble_is_over(struct trouble *t);

#endif
