/* SPDX-License-Identifier: MIT */
/* Calls a function that is nowhere: found out when it is loaded, not in the cycle. */
#include <ecdaq/control.h>

int function_that_is_nowhere(void);

static int begin(const struct ecdaq_init *in, void **ret_state)
{
	(void)in;
	(void)ret_state;
	return function_that_is_nowhere();
}

static int go_on(const struct ecdaq_cycle *cy, void *state)
{
	(void)cy;
	(void)state;
	return ECDAQ_GO_ON;
}

const struct ecdaq_program ecdaq_program = {
	ECDAQ_PROGRAM_HEAD,
	.name = "missing symbol",
	.init = begin,
	.cycle = go_on,
};
