/* SPDX-License-Identifier: MIT */
#include "program/exit_code.h"

static const char *const texts[EXIT_CODE_COUNT] = {
	[EXIT_CODE_OK] = "success; stopped on request",
	[EXIT_CODE_FAILED] = "failed for a reason without a number of its own",
	[EXIT_CODE_USAGE] = "invalid command line",
	[EXIT_CODE_CONFIG] = "invalid configuration",
	[EXIT_CODE_PERMISSION] = "permission denied",
	[EXIT_CODE_INTERFACE] = "network interface not found, or down",
	[EXIT_CODE_BUSY] = "run directory, interface, recordings, GPIO line or port in use",
	[EXIT_CODE_RESOURCES] = "out of memory, or run directory full",
	[EXIT_CODE_NO_SLAVE] = "no slave answers",
	[EXIT_CODE_SLAVES] = "slave missing, unexpected, or of another type",
	[EXIT_CODE_MAPPING] = "process data cannot be mapped",
	[EXIT_CODE_CLOCKS] = "distributed clocks did not lock",
	[EXIT_CODE_STATE] = "slave refused a state (AL error) or did not reach it",
	[EXIT_CODE_WIRE] = "frames lost or damaged",
	[EXIT_CODE_OVERRUN] =
		"overrun or lost DC lock, and cycle.overrun or dc.unlock_policy is stop",
	[EXIT_CODE_CONTROL] = "control program crashed, hung, or overran (control.overrun stop)",
	[EXIT_CODE_NO_DAEMON] = "no ecdaqd or no data of one; or several, and none selected",
	[EXIT_CODE_REFUSED] = "refused by ecdaqd or by a slave",
	[EXIT_CODE_CHECK_FAILED] = "the recorded SYNC0 pulses failed a check",
	[EXIT_CODE_DISABLED] = "--check: configuration valid, program disabled by it",
};

const char *exit_code_to_str(enum exit_code code)
{
	return (unsigned)code < EXIT_CODE_COUNT ? texts[code] : "unknown";
}

void exit_code_help(FILE *out, uint32_t set)
{
	fputs("exit codes:\n", out);
	for (unsigned code = 0; code < EXIT_CODE_COUNT; code++) {
		if (set & UINT32_C(1) << code) {
			fprintf(out, "  %2u  %s\n", code, texts[code]);
		}
	}
}
