/* SPDX-License-Identifier: MIT */
/* The command line of ecdaqd. Context: any. */
#ifndef DAEMON_OPTIONS_H
#define DAEMON_OPTIONS_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "config/config.h"
#include "daemon/failure.h"

enum { OPTIONS_LIMIT_SETS = 256 };

enum options_verb { OPTIONS_RUN, OPTIONS_CHECK, OPTIONS_HELP, OPTIONS_VERSION };

struct options {
	enum options_verb verb;
	const char *config_path; /* NULL: the built-in defaults */
	const char *interface;   /* NULL: as configured */
	const char *run_dir;     /* NULL: as configured */
	const char *set[OPTIONS_LIMIT_SETS];
	size_t set_count;
	uint64_t cycles;  /* end after so many in OP; 0: do not */
	uint64_t seconds; /* end after so many in OP; 0: do not */
	int can_wait;     /* try again while there is no slave or no link */
	int is_simulated;
};

/** Strings point into @argv. 0, or -EINVAL with @failure; @ret_options is untouched then. */
int options_parse(int argc, const char *const *argv, struct options *ret_options,
		  struct failure *failure);

/** The configuration that @options ask for: file, --set in order, the rest. 0 or -errno with
 * @failure. */
int options_apply(const struct options *options, struct config *ret_cfg, struct failure *failure);

void options_help(FILE *out);

#endif
