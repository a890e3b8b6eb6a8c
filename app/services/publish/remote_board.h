/* SPDX-License-Identifier: MIT */
/*
 * The remote command board of the running master, as its one writer sees it: the socket
 * "commands-remote" in the run directory hands it over. Follows the master through restarts.
 * Context: any but the cycle.
 */
#ifndef PUBLISH_REMOTE_BOARD_H
#define PUBLISH_REMOTE_BOARD_H

#include <time.h>

#include "base/board.h"
#include "config/config.h"

struct remote_board {
	char path[CONFIG_PATH_BYTES];
	struct board *board; /* NULL: none is open */
	int socket;          /* on which it is to come; -1: it is not waited for */
	uint64_t inode;      /* of the socket's name, which a new master makes anew */
	struct timespec made;
};

void remote_board_init(struct remote_board *rb);

/**
 * Ask for what is there, or for another one in its place; never waits. 0: nothing new, it may be on
 * its way; 1: a board has come; -errno: -ENOENT, -EACCES, -EPROTO, -ECONNREFUSED.
 */
int remote_board_follow(struct remote_board *rb);
void remote_board_close(struct remote_board *rb);

#endif
