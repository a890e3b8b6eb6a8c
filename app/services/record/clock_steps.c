/* SPDX-License-Identifier: MIT */
#include "record/clock_steps.h"

#include <inttypes.h>
#include <stdio.h>

void clock_steps_note(struct clock_steps *steps, int64_t step_ns)
{
	steps->step_ns = step_ns;
	steps->waiting++;
}

int clock_steps_is_due(const struct clock_steps *steps, int64_t now_ns)
{
	return steps->waiting > 0 &&
	       (steps->ended_ns == 0 || now_ns - steps->ended_ns >= CLOCK_STEPS_PERIOD_NS);
}

void clock_steps_take(struct clock_steps *steps, int64_t now_ns, char *line, size_t line_bytes)
{
	if (steps->waiting > 1) {
		snprintf(line, line_bytes, "the host's clock took %" PRIu64 " steps: new file",
			 steps->waiting);
	} else {
		snprintf(line, line_bytes,
			 "the host's clock took a step of %" PRId64 " ns: new file",
			 steps->step_ns);
	}
	steps->ended_ns = now_ns;
	steps->waiting = 0;
}

void clock_steps_forget(struct clock_steps *steps)
{
	steps->waiting = 0;
}
