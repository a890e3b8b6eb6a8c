/* SPDX-License-Identifier: MIT */
/* The control program in the cycle: after the inputs were judged, before the outputs are chosen. */
#include <errno.h>

#include "base/slave_set.h"
#include "control/program.h"
#include "cycle/cycle_internal.h"

static void note_crash(struct cycle *cy)
{
	struct control_crash crash = { 0 };

	if (control_crash(cy->spec.control, &crash) == 0) {
		cycle_note(cy, EVENT_CONTROL_CRASHED, (int64_t)crash.address, crash.number, 0);
	}
}

static void run(struct cycle *cy)
{
	struct control *control = cy->spec.control;
	enum control_result result = control_run(control, &cy->sample, cy->image);
	int64_t cycle = (int64_t)cy->sample.cycle;

	switch (result) {
	case CONTROL_DONE:
	case CONTROL_REST:
		break;
	case CONTROL_CRASH:
		note_crash(cy);
		cycle_end_safely(cy, -EFAULT);
		break;
	case CONTROL_STOP:
		cycle_end_safely(cy, -ETIMEDOUT);
		/* fall through */
	case CONTROL_PARK:
	case CONTROL_OVERRAN:
		cycle_note(cy, EVENT_CONTROL_OVERRUN, cycle, control_time_ns(control),
			   cy->spec.cfg->control_budget_ns);
		break;
	}
}

void cycle_control(struct cycle *cy)
{
	if (cy->spec.control == NULL) {
		return;
	}
	if (slave_set_is_empty(cycle_outputs_live(cy))) {
		control_pause(cy->spec.control);
	} else {
		run(cy);
	}
}

int cycle_is_control_safe(const struct cycle *cy)
{
	return cy->spec.control != NULL && control_is_safe(cy->spec.control);
}
