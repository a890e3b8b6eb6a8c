/* SPDX-License-Identifier: MIT */
#include "admin/server.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

enum { SOCKET_MODE = 0660 };

struct client {
	int fd; /* -1: free */
	uint32_t uid;
	int is_waiting; /* a reply waits for the cycle */
	uint64_t sequence;
	mono_t give_up;
	struct admin_reply reply;
};

struct listener {
	int fd; /* -1: none */
	char path[sizeof(((struct sockaddr_un *)0)->sun_path)];
};

struct admin_server {
	int poller;
	struct listener admin;
	struct listener offer; /* of the board */
	int board_fd;
	struct client client[ADMIN_CLIENTS];
};

static int fail(char *error, size_t error_bytes, const char *path, int r)
{
	snprintf(error, error_bytes, "admin socket %s: %s", path, strerror(-r));
	return r;
}

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
	    listen(listener->fd, ADMIN_CLIENTS) < 0 || rename(temporary, listener->path) < 0) {
		int r = -errno;

		unlink(temporary);
		return r;
	}
	return 0;
}

static void listener_close(struct listener *listener)
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

static int listen_at(struct listener *listener, const char *path, gid_t group, int poller)
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

int admin_server_create(const char *path, gid_t group, struct admin_server **ret_server,
			char *error, size_t error_bytes)
{
	struct admin_server *server = calloc(1, sizeof(*server));
	int r;

	if (server == NULL) {
		return fail(error, error_bytes, path, -ENOMEM);
	}
	server->admin.fd = -1;
	server->offer.fd = -1;
	for (size_t i = 0; i < ADMIN_CLIENTS; i++) {
		server->client[i].fd = -1;
	}
	server->poller = epoll_create1(EPOLL_CLOEXEC);
	r = server->poller < 0 ? -errno : listen_at(&server->admin, path, group, server->poller);
	if (r < 0) {
		admin_server_destroy(server);
		return fail(error, error_bytes, path, r);
	}
	*ret_server = server;
	return 0;
}

int admin_server_offer_board(struct admin_server *server, const char *path, gid_t group,
			     int board_fd, char *error, size_t error_bytes)
{
	int r = listen_at(&server->offer, path, group, server->poller);

	server->board_fd = board_fd;
	return r < 0 ? fail(error, error_bytes, path, r) : 0;
}

static void client_close(struct client *client)
{
	close(client->fd); /* leaves the poller with it */
	client->fd = -1;
	client->is_waiting = 0;
}

void admin_server_destroy(struct admin_server *server)
{
	if (server == NULL) {
		return;
	}
	for (size_t i = 0; i < ADMIN_CLIENTS; i++) {
		if (server->client[i].fd >= 0) {
			client_close(&server->client[i]);
		}
	}
	listener_close(&server->admin);
	listener_close(&server->offer);
	if (server->poller >= 0) {
		close(server->poller);
	}
	free(server);
}

int admin_server_fd(const struct admin_server *server)
{
	return server->poller;
}

static void client_send(struct client *client)
{
	/* A client that does not read its reply, or has disconnected, is closed without waiting. */
	if (send(client->fd, &client->reply, sizeof(client->reply), MSG_NOSIGNAL | MSG_DONTWAIT) !=
	    (ssize_t)sizeof(client->reply)) {
		client_close(client);
	}
}

static struct client *free_client(struct admin_server *server)
{
	for (size_t i = 0; i < ADMIN_CLIENTS; i++) {
		if (server->client[i].fd < 0) {
			return &server->client[i];
		}
	}
	return NULL;
}

static void turn_away(int fd)
{
	struct client late = { .fd = fd, .reply = { .magic = ADMIN_MAGIC } };

	admin_reply_refuse(&late.reply, -EBUSY, "too many clients (ADMIN_CLIENTS = %d)",
			   ADMIN_CLIENTS);
	client_send(&late);
	if (late.fd >= 0) {
		close(late.fd);
	}
}

static void accept_clients(struct admin_server *server)
{
	struct ucred peer = { .uid = (uid_t)-1 };
	socklen_t peer_bytes = sizeof(peer);
	struct epoll_event interest = { .events = EPOLLIN };
	int fd;

	while ((fd = accept4(server->admin.fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0) {
		struct client *client = free_client(server);

		if (client == NULL) {
			turn_away(fd);
			continue;
		}
		peer_bytes = sizeof(peer);
		if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &peer_bytes) < 0 ||
		    epoll_ctl(server->poller, EPOLL_CTL_ADD, fd, &interest) < 0) {
			close(fd);
			continue;
		}
		client->fd = fd;
		client->uid = peer.uid;
		client->is_waiting = 0;
	}
}

static void handle(struct client *client, const struct admin_target *target, const void *message,
		   size_t len, mono_t now)
{
	struct admin_request request;
	char why[ADMIN_TEXT_BYTES];
	int r = admin_request_parse(message, len, &request, why);

	if (r < 0) {
		client->reply = (struct admin_reply){ .magic = ADMIN_MAGIC };
		admin_reply_refuse(&client->reply, r, "%s", why);
		client_send(client);
		/* A client that violates the protocol is disconnected. */
		if (r != -EINVAL && client->fd >= 0) {
			client_close(client);
		}
		return;
	}
	if (admin_command_run(target, &request, client->uid, &client->reply, &client->sequence) ==
	    ADMIN_DEFERRED) {
		client->is_waiting = 1;
		client->give_up = mono_add(now, (span_t){ ADMIN_ANSWER_TIMEOUT_NS });
		return;
	}
	client_send(client);
}

static void read_client(struct client *client, const struct admin_target *target, mono_t now)
{
	struct admin_request message;
	ssize_t len = recv(client->fd, &message, sizeof(message), MSG_DONTWAIT | MSG_TRUNC);

	if (len < 0 && (errno == EAGAIN || errno == EINTR)) {
		return;
	}
	if (len <= 0) {
		client_close(client);
		return;
	}
	handle(client, target, &message, (size_t)len, now);
}

static void answer_due(struct client *client, const struct admin_target *target, mono_t now)
{
	if (target->board != NULL &&
	    admin_reply_finish(target->board, client->sequence, &client->reply)) {
		client->is_waiting = 0;
		client_send(client);
		return;
	}
	if (target->board == NULL || now.ns >= client->give_up.ns) {
		client->is_waiting = 0;
		admin_reply_refuse(&client->reply, -ETIMEDOUT,
				   "the cycle did not take the values in time");
		client_send(client);
	}
}

/* One byte to carry the descriptor; reads nothing, never blocks. */
static void give_board(int to, int board_fd)
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
	memcpy(CMSG_DATA(header), &board_fd, sizeof(board_fd));
	(void)!sendmsg(to, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
}

static void serve_offer(const struct admin_server *server)
{
	int fd;

	for (int n = 0; server->offer.fd >= 0 && n < ADMIN_CLIENTS; n++) {
		fd = accept4(server->offer.fd, NULL, NULL, SOCK_CLOEXEC);
		if (fd < 0) {
			return;
		}
		give_board(fd, server->board_fd);
		close(fd);
	}
}

unsigned admin_server_service(struct admin_server *server, const struct admin_target *target,
			      mono_t now)
{
	unsigned waiting = 0;

	serve_offer(server);
	accept_clients(server);
	for (size_t i = 0; i < ADMIN_CLIENTS; i++) {
		struct client *client = &server->client[i];

		if (client->fd >= 0 && client->is_waiting) {
			answer_due(client, target, now);
		}
		if (client->fd >= 0 && !client->is_waiting) {
			read_client(client, target, now);
		}
		waiting += (unsigned)(client->fd >= 0 && client->is_waiting);
	}
	return waiting;
}
