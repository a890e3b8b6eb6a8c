/* SPDX-License-Identifier: MIT */
/*
 * The run directory: made, locked against a second instance, with the status page, the event ring
 * and the remote command board in it. It lives as long as the program; sessions on the bus come and
 * go inside it.
 */
#ifndef DAEMON_RUN_DIR_H
#define DAEMON_RUN_DIR_H

#include <stddef.h>
#include <sys/types.h>

#include "base/board.h"
#include "base/platform.h"
#include "base/ring.h"
#include "base/status.h"
#include "config/config.h"
#include "daemon/failure.h"

struct run_dir {
	char dir[CONFIG_PATH_BYTES];
	gid_t group;        /* of the directory; (gid_t)-1: leave */
	gid_t admin_group;  /* of the admin socket; the same */
	gid_t remote_group; /* of the socket that gives the board; the same */
	int lock;           /* descriptor that holds the lock; -1: none */
	int is_tmpfs;
	struct status_page *page;
	struct ring *events;
	struct board *remote; /* outputs set by ecdaq-dds */
	int remote_fd;        /* the same, to be given to it; -1: none */
};

enum run_dir_segment { RUN_DIR_REAL, RUN_DIR_SIMULATED };

/**
 * Make all of it. 0 or -errno with @failure: no permission, another instance, tmpfs full, no such
 * group. Close with run_dir_close(), also after a failure. Context: blocking.
 */
int run_dir_open(struct run_dir *run, const struct config *cfg, const struct platform *platform,
		 enum run_dir_segment segment, struct failure *failure);
/** Release the lock; the files stay for readers. */
void run_dir_close(struct run_dir *run);

/** The path of @file inside. 0 or -ENAMETOOLONG. */
int run_dir_path(const struct run_dir *run, const char *file, char *ret_path, size_t path_bytes);

/** The page's message; "" for none. Context: service thread. */
void run_dir_set_message(struct run_dir *run, const char *text);

/**
 * Claim the NIC @name in this network namespace, so that two masters never share it. A descriptor
 * to close at the end, or -errno with @failure. Context: blocking.
 */
int run_dir_claim_interface(const char *name, struct failure *failure);

#endif
