/* SPDX-License-Identifier: MIT */
#include "daemon/exit_code.h"

#include <errno.h>

static const struct {
	const char *text;
	enum exit_code_hope hope;
} codes[EXIT_CODE_COUNT] = {
	[EXIT_CODE_OK] = { "stopped in order, as it was told to", EXIT_CODE_LASTING },
	[EXIT_CODE_INTERNAL] = { "failed for a reason without a number of its own",
				 EXIT_CODE_LASTING },
	[EXIT_CODE_USAGE] = { "wrong command line", EXIT_CODE_LASTING },
	[EXIT_CODE_CONFIG] = { "wrong configuration", EXIT_CODE_LASTING },
	[EXIT_CODE_PERMISSION] = { "no permission", EXIT_CODE_LASTING },
	[EXIT_CODE_INTERFACE] = { "no such network interface, or it is down", EXIT_CODE_PASSING },
	[EXIT_CODE_BUSY] = { "another ecdaqd has the run directory or the interface",
			     EXIT_CODE_LASTING },
	[EXIT_CODE_RESOURCES] = { "no memory, or the run directory is full", EXIT_CODE_LASTING },
	[EXIT_CODE_NO_SLAVE] = { "no slave answers", EXIT_CODE_PASSING },
	[EXIT_CODE_SLAVES] = { "a slave too few, too many, or a wrong one", EXIT_CODE_PASSING },
	[EXIT_CODE_MAPPING] = { "process data cannot be mapped", EXIT_CODE_LASTING },
	[EXIT_CODE_CLOCKS] = { "distributed clocks did not lock", EXIT_CODE_PASSING },
	[EXIT_CODE_STATE] = { "a slave refused a state (AL error) or did not reach it",
			      EXIT_CODE_PASSING },
	[EXIT_CODE_WIRE] = { "frames get lost or damaged", EXIT_CODE_PASSING },
	[EXIT_CODE_OVERRUN] = { "the cycle overran and cycle.overrun is stop", EXIT_CODE_LASTING },
	[EXIT_CODE_CONTROL] = { "the control program crashed, hung, or took too long and "
				"control.overrun is stop",
				EXIT_CODE_LASTING },
};

const char *exit_code_to_str(enum exit_code code)
{
	return (unsigned)code < EXIT_CODE_COUNT ? codes[code].text : "unknown";
}

enum exit_code_hope exit_code_hope(enum exit_code code)
{
	return (unsigned)code < EXIT_CODE_COUNT ? codes[code].hope : EXIT_CODE_LASTING;
}

enum exit_code exit_code_of_bus(int r, enum exit_code otherwise)
{
	switch (-r) {
	case ENODEV:
		return EXIT_CODE_NO_SLAVE;
	case ENXIO:
		return EXIT_CODE_SLAVES;
	case EPROTO:
	case E2BIG:
	case ENOTSUP:
		return EXIT_CODE_MAPPING;
	case EIO:
	case ENETDOWN:
		return EXIT_CODE_WIRE;
	case ENOMEM:
	case ENOSPC:
		return EXIT_CODE_RESOURCES;
	case EINVAL:
		return EXIT_CODE_CONFIG;
	default:
		return otherwise;
	}
}
