/* SPDX-License-Identifier: MIT */
/* Filled in by hand, with errors. */
#include <ecdaq/control.h>

static int begin(const struct ecdaq_init *in, void **ret_state)
{
	(void)in;
	(void)ret_state;
	return 0;
}

static int go_on(const struct ecdaq_cycle *cy, void *state)
{
	(void)cy;
	(void)state;
	return ECDAQ_GO_ON;
}

const struct ecdaq_program ecdaq_program = {
	.abi = ECDAQ_CONTROL_ABI, .bytes = 8, .cycle = go_on, .init = begin
};
