/* SPDX-License-Identifier: MIT */
#include "base/listener.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SOCKET_MODE = 0660 };

/* Mode and group are set before anyone can connect: the socket is renamed last. */
static int name_it(const struct listener *listener, gid_t group)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	char temporary[sizeof(address.sun_path)];

	if (snprintf(temporary, sizeof(temporary), "%s.new", listener->path) >=
	    (int)sizeof(temporary)) {
		return -ENAMETOOLONG;
	}
	memcpy(address.sun_path, temporary, sizeof(temporary));
	unlink(temporary);
	if (bind(listener->fd, (const struct sockaddr *)&address, sizeof(address)) < 0) {
		return -errno;
	}
	if (chmod(temporary, SOCKET_MODE) < 0 ||
	    (group != (gid_t)-1 && chown(temporary, (uid_t)-1, group) < 0) ||
	    listen(listener->fd, LISTENER_BACKLOG) < 0 || rename(temporary, listener->path) < 0) {
		int r = -errno;

		unlink(temporary);
		return r;
	}
	return 0;
}

void listener_close(struct listener *listener)
{
	if (listener->fd >= 0) {
		close(listener->fd);
		listener->fd = -1;
	}
	if (listener->path[0] != '\0') {
		unlink(listener->path);
		listener->path[0] = '\0';
	}
}

int listener_open(struct listener *listener, const char *path, gid_t group, int poller)
{
	struct epoll_event interest = { .events = EPOLLIN };
	int r;

	if (snprintf(listener->path, sizeof(listener->path), "%s", path) >=
	    (int)sizeof(listener->path)) {
		r = -ENAMETOOLONG;
	} else {
		listener->fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
		r = listener->fd < 0 ? -errno : name_it(listener, group);
	}
	if (r < 0) {
		listener->path[0] = '\0'; /* nothing of ours to unlink */
	} else if (epoll_ctl(poller, EPOLL_CTL_ADD, listener->fd, &interest) < 0) {
		r = -errno;
	}
	if (r < 0) {
		listener_close(listener);
	}
	return r;
}

/* One byte to carry the descriptor. */
void listener_give_fd(int to, int fd)
{
	char byte = 0;
	struct iovec data = { .iov_base = &byte, .iov_len = sizeof(byte) };
	union {
		struct cmsghdr header;
		char bytes[CMSG_SPACE(sizeof(int))];
	} control = { .bytes = { 0 } };
	struct msghdr message = { .msg_iov = &data,
				  .msg_iovlen = 1,
				  .msg_control = &control,
				  .msg_controllen = sizeof(control.bytes) };
	struct cmsghdr *header = CMSG_FIRSTHDR(&message);

	header->cmsg_level = SOL_SOCKET;
	header->cmsg_type = SCM_RIGHTS;
	header->cmsg_len = CMSG_LEN(sizeof(int));
	memcpy(CMSG_DATA(header), &fd, sizeof(fd));
	(void)!sendmsg(to, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
}
