/* SPDX-License-Identifier: MIT */
#include "harness/control_probe/probe.h"

#include <stddef.h>

extern struct probe probe;
struct probe probe;

static int run_init(const struct ecdaq_init *in, void **ret_state)
{
	return probe.init != NULL ? probe.init(in, ret_state) : 0;
}

static int run_cycle(const struct ecdaq_cycle *cy, void *state)
{
	return probe.cycle != NULL ? probe.cycle(cy, state) : ECDAQ_GO_ON;
}

static void run_exit(void *state)
{
	if (probe.exit != NULL) {
		probe.exit(state);
	}
}

const struct ecdaq_program ecdaq_program = {
	ECDAQ_PROGRAM_HEAD, .name = "probe", .init = run_init, .cycle = run_cycle, .exit = run_exit,
};
