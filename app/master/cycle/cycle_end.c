/* SPDX-License-Identifier: MIT */
/* The end of the cycle by its own decision: frames with fail-safe values first. */
#include "cycle/cycle_internal.h"

/* Number of frames with fail-safe values of all outputs before the cycle ends. */
enum { LAST_CYCLES = 4 };

void cycle_end_safely(struct cycle *cy, int result)
{
	if (cy->last_steps > 0) {
		return; /* it ends already: another reason must not put that off */
	}
	cy->is_latched_safe = 1;
	cy->result = result;
	cy->last_steps = LAST_CYCLES + 1;
}

void cycle_count_down(struct cycle *cy)
{
	if (cy->last_steps == 0) {
		return;
	}
	cy->last_steps--;
	if (cy->last_steps == 0) {
		cycle_stop(cy);
	}
}
