/* SPDX-License-Identifier: MIT */
/* The run directories of the ecdaqd that are running, for where none was named. Context: blocking.
 */
#ifndef CLI_RUNNING_H
#define CLI_RUNNING_H

#include <stddef.h>
#include <stdint.h>

#include "config/config.h"

struct running {
	char dir[CONFIG_PATH_BYTES]; /* with a slash at its end */
	int64_t pid;
	char interface[32]; /* NIC of the segment */
	int is_simulated;
};

/**
 * Look at @system_dir ("/run/ecdaq") and at the directories of this user that are named "ecdaq-*"
 * in
 * @parent_dir ("/dev/shm": that of a user, and one for each ./build.sh run). Running: there is a
 * status page and the process that wrote it. Fills up to @limit of @ret_found, by name; returns
 * their number.
 */
size_t running_find(const char *system_dir, const char *parent_dir, struct running *ret_found,
		    size_t limit);

#endif
