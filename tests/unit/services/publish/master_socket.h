/* SPDX-License-Identifier: MIT */
/* The master's side of "commands-remote": gives whoever connects a descriptor of a test's choice.
 */
#ifndef MASTER_SOCKET_H
#define MASTER_SOCKET_H

#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "harness/test.h"

/** A new listening socket at @dir/commands-remote, in the place of an old one. */
static inline int master_socket_listen(const char *dir)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int listener = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);

	CHECK(snprintf(address.sun_path, sizeof(address.sun_path), "%s/commands-remote", dir) > 0);
	unlink(address.sun_path);
	CHECK_EQ(bind(listener, (const struct sockaddr *)&address, sizeof(address)), 0);
	CHECK_EQ(listen(listener, 4), 0);
	return listener;
}

/** Accept one connection and send one byte with @given; -1: without a descriptor. */
static inline void master_socket_serve(int listener, int given)
{
	int client = accept4(listener, NULL, NULL, SOCK_CLOEXEC);
	char byte = 0;
	struct iovec data = { .iov_base = &byte, .iov_len = 1 };
	union {
		struct cmsghdr header;
		char bytes[CMSG_SPACE(sizeof(int))];
	} control = { .bytes = { 0 } };
	struct msghdr message = { .msg_iov = &data, .msg_iovlen = 1 };

	CHECK(client >= 0);
	if (given >= 0) {
		message.msg_control = &control;
		message.msg_controllen = sizeof(control.bytes);
		control.header.cmsg_level = SOL_SOCKET;
		control.header.cmsg_type = SCM_RIGHTS;
		control.header.cmsg_len = CMSG_LEN(sizeof(int));
		memcpy(CMSG_DATA(&control.header), &given, sizeof(given));
	}
	CHECK_EQ(sendmsg(client, &message, 0), 1);
	close(client);
}

#endif
