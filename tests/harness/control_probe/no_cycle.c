/* SPDX-License-Identifier: MIT */
/* Without cycle(). */
#include <ecdaq/control.h>

static int begin(const struct ecdaq_init *in, void **ret_state)
{
	(void)in;
	(void)ret_state;
	return 0;
}

const struct ecdaq_program ecdaq_program = { .abi = ECDAQ_CONTROL_ABI,
					     .bytes = sizeof(struct ecdaq_program),
					     .init = begin };
