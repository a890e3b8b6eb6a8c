/* SPDX-License-Identifier: MIT */
/*
 * How a program of ecdaq ended, for scripts and service managers. One meaning for each number, in
 * all programs (app/doc/reference/exit-codes.md). Part of the interface: numbers do not change.
 */
#ifndef PROGRAM_EXIT_CODE_H
#define PROGRAM_EXIT_CODE_H

#include <stdint.h>
#include <stdio.h>

enum exit_code {
	EXIT_CODE_OK = 0,
	EXIT_CODE_FAILED = 1,     /* any failure without a number of its own */
	EXIT_CODE_USAGE = 2,      /* the command line */
	EXIT_CODE_CONFIG = 3,     /* the configuration */
	EXIT_CODE_PERMISSION = 4, /* access was denied */
	EXIT_CODE_INTERFACE = 5,  /* no such NIC, or it is down */
	EXIT_CODE_BUSY = 6,       /* run directory, NIC, recordings, GPIO line, port in use */
	EXIT_CODE_RESOURCES = 7,  /* memory, or the tmpfs of the ring */
	EXIT_CODE_NO_SLAVE = 8,   /* no slave answers */
	EXIT_CODE_SLAVES = 9,     /* a slave too few, too many, or the wrong one */
	EXIT_CODE_MAPPING = 10,   /* process data do not fit */
	EXIT_CODE_CLOCKS = 11,    /* distributed clocks or the servo did not lock */
	EXIT_CODE_STATE = 12,     /* an AL error, or a state was not reached */
	EXIT_CODE_WIRE = 13,      /* frames are lost or damaged */
	EXIT_CODE_OVERRUN = 14,   /* an overrun or a lost clock, and the policy for it is stop */
	EXIT_CODE_CONTROL = 15,   /* the control program crashed, hung, or was too slow for stop */
	EXIT_CODE_NO_DAEMON = 16, /* no ecdaqd, or nothing of it to read, or more than one */
	EXIT_CODE_REFUSED = 17,   /* by ecdaqd or by a slave */
	EXIT_CODE_CHECK_FAILED = 18, /* the SYNC0 pulses in a file are bad */
	EXIT_CODE_DISABLED = 19,     /* --check: valid, but the program is disabled */
	EXIT_CODE_COUNT,
};

/** One line for --help and the reference; "unknown" for a number out of range. Context: any. */
const char *exit_code_to_str(enum exit_code code);

/** A set of codes, for exit_code_help(). */
#define EXIT_CODE_BIT(name) (UINT32_C(1) << EXIT_CODE_##name)
/** The codes that every program has. */
#define EXIT_CODE_COMMON (EXIT_CODE_BIT(OK) | EXIT_CODE_BIT(FAILED) | EXIT_CODE_BIT(USAGE))

/** Write "exit codes:" and a line for each code of @set. Context: blocking (stdio). */
void exit_code_help(FILE *out, uint32_t set);

#endif
