/* SPDX-License-Identifier: MIT */
/*
 * The remote command board of the running master, for its only writer. It is received over the
 * socket "commands-remote" in the run directory, again after each restart of the master.
 * Context: any but the cycle.
 */
#ifndef PUBLISH_REMOTE_BOARD_H
#define PUBLISH_REMOTE_BOARD_H

#include <time.h>

#include "base/board.h"
#include "config/config.h"

struct remote_board {
	char path[CONFIG_PATH_BYTES];
	struct board *board; /* NULL: none */
	int socket;          /* connected, board not yet received; -1: none */
	uint64_t inode;      /* of the socket's path: each master creates a new one */
	struct timespec made;
};

void remote_board_init(struct remote_board *rb);

/**
 * Request the board, or that of a new master; never blocks. 0: nothing new, a request may be
 * pending; 1: a board was received; -errno: -ENOENT, -EACCES, -EPROTO, -ECONNREFUSED.
 */
int remote_board_follow(struct remote_board *rb);
void remote_board_close(struct remote_board *rb);

#endif
