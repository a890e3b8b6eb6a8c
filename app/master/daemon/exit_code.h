/* SPDX-License-Identifier: MIT */
/* How ecdaqd ended, for scripts and service managers. Part of the interface: numbers do not change.
 */
#ifndef DAEMON_EXIT_CODE_H
#define DAEMON_EXIT_CODE_H

enum exit_code {
	EXIT_CODE_OK = 0,
	EXIT_CODE_INTERNAL = 1,   /* something that has no other number */
	EXIT_CODE_USAGE = 2,      /* the command line */
	EXIT_CODE_CONFIG = 3,     /* the configuration */
	EXIT_CODE_PERMISSION = 4, /* a right is missing */
	EXIT_CODE_INTERFACE = 5,  /* no such NIC, or it is down */
	EXIT_CODE_BUSY = 6,       /* a second instance on the run directory or the NIC */
	EXIT_CODE_RESOURCES = 7,  /* memory, or the tmpfs of the ring */
	EXIT_CODE_NO_SLAVE = 8,   /* nobody answers */
	EXIT_CODE_SLAVES = 9,     /* a slave too few, too many, or the wrong one */
	EXIT_CODE_MAPPING = 10,   /* process data do not fit */
	EXIT_CODE_CLOCKS = 11,    /* distributed clocks or the servo did not lock */
	EXIT_CODE_STATE = 12,     /* an AL error, or a state was not reached */
	EXIT_CODE_WIRE = 13,      /* frames get lost or damaged */
	EXIT_CODE_OVERRUN = 14,   /* an overrun, and cycle.overrun is stop */
	EXIT_CODE_CONTROL = 15,   /* the control program crashed, hung, or was too slow for stop */
	EXIT_CODE_COUNT,
};

/** One line for --help and the reference; "unknown" for a number out of range. */
const char *exit_code_to_str(enum exit_code code);

enum exit_code_hope { EXIT_CODE_LASTING, EXIT_CODE_PASSING };
/** PASSING: the same attempt may do better later (no slave yet), so --wait tries again. */
enum exit_code_hope exit_code_hope(enum exit_code code);

/** What a call of bus/bus.h that failed with @r means; @otherwise for a state or lock not reached.
 */
enum exit_code exit_code_of_bus(int r, enum exit_code otherwise);

#endif
