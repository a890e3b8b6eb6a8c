/* SPDX-License-Identifier: MIT */
/* The configuration that a verb is about: a file that was named, else that of an ecdaqd. Context:
 * blocking. */
#ifndef CLI_CONFIG_FILE_H
#define CLI_CONFIG_FILE_H

#include "base/args.h"
#include "cli/cli.h"
#include "cli/resolve.h"

struct config_file {
	const char *path; /* as it is opened; NULL: none, the defaults */
	const char *name; /* for people */
	struct args_list set;
	/* What the others point into. */
	char opened[PROBE_PATH_BYTES];
	char text[RESOLVE_TEXT_BYTES];
	char interface[64];
};

/**
 * @named, else --config, else what the running ecdaqd was started with, else what the appliance's
 * would be, else the defaults; with @more over it. EXIT_CODE_OK, or the code of a failure, which
 * was reported: several are running, too many --set.
 */
enum exit_code config_file_find(struct cli *cli, const char *named, const struct args_list *more,
				struct config_file *ret_file);

#endif
