/* SPDX-License-Identifier: MIT */
#include "publish/remote_board.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

void remote_board_init(struct remote_board *rb)
{
	*rb = (struct remote_board){ .socket = -1 };
}

static int request(struct remote_board *rb)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };

	if (snprintf(address.sun_path, sizeof(address.sun_path), "%s", rb->path) >=
	    (int)sizeof(address.sun_path)) {
		return -ENAMETOOLONG;
	}
	rb->socket = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (rb->socket < 0) {
		return -errno;
	}
	if (connect(rb->socket, (const struct sockaddr *)&address, sizeof(address)) < 0) {
		int r = -errno;

		remote_board_close(rb);
		return r;
	}
	return 0;
}

/* The descriptor received with @message; -1: none. */
static int descriptor_of(struct msghdr *message)
{
	int fd = -1;

	for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c != NULL; c = CMSG_NXTHDR(message, c)) {
		if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SCM_RIGHTS &&
		    c->cmsg_len == CMSG_LEN(sizeof(int))) {
			memcpy(&fd, CMSG_DATA(c), sizeof(fd));
		}
	}
	return fd;
}

static int receive(struct remote_board *rb)
{
	char byte;
	struct iovec data = { .iov_base = &byte, .iov_len = sizeof(byte) };
	union {
		struct cmsghdr header;
		char bytes[CMSG_SPACE(sizeof(int))];
	} control;
	struct msghdr message = { .msg_iov = &data,
				  .msg_iovlen = 1,
				  .msg_control = &control,
				  .msg_controllen = sizeof(control.bytes) };
	ssize_t len;
	int fd;
	int r;

	if (rb->socket < 0) {
		return 0;
	}
	len = recvmsg(rb->socket, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
	if (len < 0 && (errno == EAGAIN || errno == EINTR)) {
		return 0;
	}
	r = len < 0 ? -errno : -EPROTO;
	fd = len < 0 ? -1 : descriptor_of(&message);
	close(rb->socket);
	rb->socket = -1;
	if (fd >= 0) {
		rb->board = board_map(fd);
		r = rb->board == NULL ? -errno : 1;
		close(fd);
	}
	return r;
}

int remote_board_follow(struct remote_board *rb)
{
	struct stat st;
	int r;

	if (stat(rb->path, &st) < 0) {
		return -errno;
	}
	/* Inode numbers may be reused at once. */
	if (rb->inode != st.st_ino || rb->made.tv_sec != st.st_ctim.tv_sec ||
	    rb->made.tv_nsec != st.st_ctim.tv_nsec) {
		remote_board_close(rb);
	}
	if (rb->board != NULL) {
		return 0;
	}
	r = rb->socket < 0 ? request(rb) : 0;
	rb->inode = st.st_ino;
	rb->made = st.st_ctim;
	return r < 0 ? r : receive(rb);
}

void remote_board_close(struct remote_board *rb)
{
	if (rb->socket >= 0) {
		close(rb->socket);
		rb->socket = -1;
	}
	board_unmap(rb->board);
	rb->board = NULL;
}
