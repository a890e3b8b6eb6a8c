/* SPDX-License-Identifier: MIT */
/* The command line of ecdaq-sim. */
#ifndef SIM_SIMULATOR_OPTIONS_H
#define SIM_SIMULATOR_OPTIONS_H

#include <stdint.h>

#include "base/args.h"
#include "segment/signal.h"

struct sim_options {
	const char *interface;
	const char *slaves;
	const char *sii_dir;
	const char *ppm;
	const char *faults;
	const char *control;
	const char *edges;
	struct args_integer edges_keep_mib; /* 0: all */
	struct signal_spec signal;
	double wander_ppm;
	struct args_integer jitter_ns;
	struct args_integer transit_jitter_ns;
	struct args_integer seed;
	struct args_integer priority; /* 0: not real-time */
	struct args_integer cpu;      /* -1: any */
};

struct sim_options sim_options_default(void);
/** Fill @opt over its defaults; ends the program on --help, --version (0) and on wrong options (2).
 */
void sim_options_read(int argc, char **argv, struct sim_options *opt);

/** "ecdaq-sim: WHAT" on stderr. Returns -1. */
int sim_error(const char *what);

#endif
