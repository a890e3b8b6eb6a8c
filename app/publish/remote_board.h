/* SPDX-License-Identifier: MIT */
/*
 * The remote command board of the running master, as its one writer sees it ("commands-remote" in
 * the run directory). Follows the master through restarts. Context: any but the cycle.
 */
#ifndef PUBLISH_REMOTE_BOARD_H
#define PUBLISH_REMOTE_BOARD_H

#include "base/board.h"
#include "config/config.h"

struct remote_board {
	char path[CONFIG_PATH_BYTES];
	struct board *board; /* NULL: none is open */
	uint64_t inode;
	uint64_t device;
};

/** Open what is there, or another one in its place. 0; 1 newly opened; -errno: -ENOENT, -EACCES,
 * -EPROTO. */
int remote_board_follow(struct remote_board *rb);
void remote_board_close(struct remote_board *rb);

#endif
