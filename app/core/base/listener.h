/* SPDX-License-Identifier: MIT */
/* A listening SOCK_SEQPACKET socket in the run directory, mode 0660. Context: any but the cycle. */
#ifndef BASE_LISTENER_H
#define BASE_LISTENER_H

#include <sys/types.h>
#include <sys/un.h>

enum { LISTENER_BACKLOG = 16 };

struct listener {
	int fd; /* -1: none */
	char path[sizeof(((struct sockaddr_un *)0)->sun_path)];
};

/**
 * Listen at @path, in the epoll set @poller; a socket left by an earlier run is replaced. @group
 * (gid_t)-1: leave. 0 or -errno.
 */
int listener_open(struct listener *listener, const char *path, gid_t group, int poller);
/** Remove the socket. Also if it was not opened, with fd -1. */
void listener_close(struct listener *listener);

/** Send descriptor @fd to the peer of @to; never waits, and a peer that cannot take it gets none.
 */
void listener_give_fd(int to, int fd);

#endif
