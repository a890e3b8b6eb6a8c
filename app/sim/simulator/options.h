/* SPDX-License-Identifier: MIT */
/* The command line of ecdaq-sim. */
#ifndef SIM_SIMULATOR_OPTIONS_H
#define SIM_SIMULATOR_OPTIONS_H

#include <stdint.h>

#include "segment/signal.h"

struct sim_options {
	const char *interface;
	const char *slaves;
	const char *sii_dir;
	const char *ppm;
	const char *faults;
	const char *control;
	const char *edges;
	uint64_t edges_keep_bytes; /* 0: all */
	struct signal_spec signal;
	double wander_ppm;
	int64_t jitter_ns;
	uint64_t seed;
	int priority;
	int cpu;
};

/** Fill @opt over its defaults; ends the program on --help, --version (0) and on wrong options (2).
 */
void sim_options_read(int argc, char **argv, struct sim_options *opt);

/** "ecdaq-sim: WHAT" on stderr. Returns -1. */
int sim_error(const char *what);

#endif
