/* SPDX-License-Identifier: MIT */
/*
 * In a file log times only go up: after a step of the host's clock another file begins, but no more
 * than one in CLOCK_STEPS_PERIOD_NS, whatever the clock does. Context: any.
 */
#ifndef RECORD_CLOCK_STEPS_H
#define RECORD_CLOCK_STEPS_H

#include <stddef.h>
#include <stdint.h>

#include "base/clock.h"

#define CLOCK_STEPS_PERIOD_NS (10 * NS_PER_S)

struct clock_steps {
	int64_t ended_ns; /* monotonic, newest file that a step ended; 0: none yet */
	int64_t step_ns;  /* the newest step */
	uint64_t waiting; /* steps in the open file */
};

void clock_steps_note(struct clock_steps *steps, int64_t step_ns);
/** 1 if there was a step and the file may end now. */
int clock_steps_is_due(const struct clock_steps *steps, int64_t now_ns);
/** The file ends now because of them: one line about it in @line. */
void clock_steps_take(struct clock_steps *steps, int64_t now_ns, char *line, size_t line_bytes);
/** A new file begins, for whatever reason: none of them is in it. */
void clock_steps_forget(struct clock_steps *steps);

#endif
