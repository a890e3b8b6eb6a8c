/* SPDX-License-Identifier: MIT */
#include "network/gateway_sockets.h"

#include <errno.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <unistd.h>

enum {
	ACCEPTS_PER_PASS = 4,
	DATAGRAMS_PER_PASS = 32,
	/* More than the mails that a client may have open can be answered with, fragments apart. */
	OUT_BYTES = 16384,
	BACKLOG = 16,
	/* What the kernel holds of UDP while the bus is brought up. */
	UDP_RECEIVE_BYTES = 65536,
};

/* For the rest of a message, or for a client that does not take its answers. */
#define STALL_NS (10 * NS_PER_S)
/* A connection without a message for so long makes room for a new one. */
#define IDLE_NS (60 * NS_PER_S)

struct client {
	int fd; /* -1: free */
	struct gateway_peer peer;
	mono_t active; /* newest byte that was read or written */
	uint8_t in[GATEWAY_FRAME_BYTES];
	size_t in_len;
	uint8_t out[OUT_BYTES];
	size_t out_len;
	uint8_t is_overrun; /* an answer found no room */
};

struct gateway_sockets {
	struct gateway *gateway;
	int poller;
	int udp;
	int listener;
	uint64_t connections;
	struct client client[GATEWAY_CLIENTS];
};

/* --- answers --- */

static struct client *find_client(struct gateway_sockets *gs, uint64_t connection)
{
	for (size_t i = 0; i < GATEWAY_CLIENTS; i++) {
		if (gs->client[i].fd >= 0 && gs->client[i].peer.connection == connection) {
			return &gs->client[i];
		}
	}
	return NULL;
}

static void send_datagram(const struct gateway_sockets *gs, const struct gateway_peer *peer,
			  const uint8_t *frame, size_t len)
{
	const struct sockaddr *to = (const struct sockaddr *)(const void *)&peer->address;

	if (sendto(gs->udp, frame, len, MSG_DONTWAIT | MSG_NOSIGNAL, to, sizeof(peer->address)) <
	    0) {
		gateway_counters(gs->gateway)->dropped++;
	}
}

static void send_frame(void *ctx, const struct gateway_peer *peer, const uint8_t *frame, size_t len)
{
	struct gateway_sockets *gs = ctx;
	struct client *client;

	if (peer->connection == 0) {
		send_datagram(gs, peer, frame, len);
		return;
	}
	client = find_client(gs, peer->connection);
	if (client == NULL) {
		return;
	}
	if (len > OUT_BYTES - client->out_len) {
		client->is_overrun = 1; /* closed in the next pass: not in the engine's callback */
		return;
	}
	memcpy(client->out + client->out_len, frame, len);
	client->out_len += len;
}

/* --- connections --- */

static void close_client(struct gateway_sockets *gs, struct client *client)
{
	gateway_forget(gs->gateway, &client->peer);
	close(client->fd); /* leaves the poller with it */
	client->fd = -1;
}

static void disconnect(struct gateway_sockets *gs, struct client *client)
{
	gateway_counters(gs->gateway)->closed++;
	close_client(gs, client);
}

/* A free place, or that of the client that has been idle for longest; NULL: none. */
static struct client *find_place(struct gateway_sockets *gs, mono_t now)
{
	struct client *oldest = &gs->client[0];

	for (size_t i = 0; i < GATEWAY_CLIENTS; i++) {
		struct client *client = &gs->client[i];

		if (client->fd < 0) {
			return client;
		}
		if (client->active.ns < oldest->active.ns) {
			oldest = client;
		}
	}
	if (mono_sub(now, oldest->active).ns < IDLE_NS) {
		return NULL;
	}
	disconnect(gs, oldest);
	return oldest;
}

static void admit(struct gateway_sockets *gs, int fd, mono_t now)
{
	struct epoll_event interest = { .events = EPOLLIN };
	struct client *client = find_place(gs, now);
	int on = 1;

	if (client == NULL || epoll_ctl(gs->poller, EPOLL_CTL_ADD, fd, &interest) < 0) {
		gateway_counters(gs->gateway)->closed++;
		close(fd);
		return;
	}
	setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
	setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof(on));
	client->fd = fd;
	client->peer = (struct gateway_peer){ .connection = ++gs->connections };
	client->active = now;
	client->in_len = 0;
	client->out_len = 0;
	client->is_overrun = 0;
}

static void accept_clients(struct gateway_sockets *gs, mono_t now)
{
	for (unsigned n = 0; n < ACCEPTS_PER_PASS; n++) {
		int fd = accept4(gs->listener, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);

		if (fd < 0) {
			return;
		}
		admit(gs, fd, now);
	}
}

/* --- mails of a connection --- */

/* Whole messages of the buffer, as long as mails of this client may wait. -EBADMSG. */
static int take_frames(struct gateway_sockets *gs, struct client *client, mono_t now)
{
	struct gateway_mail mail;
	size_t pos = 0;
	int r = 0;

	while (!gateway_is_full(gs->gateway, &client->peer)) {
		r = gateway_frame_get(client->in + pos, client->in_len - pos, &mail);
		if (r <= 0) {
			break;
		}
		gateway_take(gs->gateway, &client->peer, &mail);
		pos += (size_t)r;
		client->active = now;
	}
	client->in_len -= pos;
	memmove(client->in, client->in + pos, client->in_len);
	if (r < 0) {
		gateway_counters(gs->gateway)->malformed++;
		return r;
	}
	return 0;
}

static int is_temporary(int error)
{
	return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

/* 0; -errno: the connection is over. */
static int read_client(struct client *client, mono_t now)
{
	ssize_t n;

	if (client->in_len == sizeof(client->in) || client->out_len > 0) {
		return 0; /* its mails wait, or it does not take its answers */
	}
	n = recv(client->fd, client->in + client->in_len, sizeof(client->in) - client->in_len, 0);
	if (n < 0) {
		return is_temporary(errno) ? 0 : -errno;
	}
	if (n == 0) {
		return -EPIPE;
	}
	client->in_len += (size_t)n;
	client->active = now;
	return 0;
}

static int write_client(struct client *client, mono_t now)
{
	ssize_t n;

	if (client->out_len == 0) {
		return 0;
	}
	n = send(client->fd, client->out, client->out_len, MSG_NOSIGNAL);
	if (n < 0) {
		return is_temporary(errno) ? 0 : -errno;
	}
	client->out_len -= (size_t)n;
	memmove(client->out, client->out + n, client->out_len);
	client->active = now;
	return 0;
}

/* The rest of a message, or of our answer, does not move on. */
static int is_stalled(const struct gateway_sockets *gs, const struct client *client, mono_t now)
{
	return (client->in_len > 0 || client->out_len > 0) &&
	       !gateway_is_full(gs->gateway, &client->peer) &&
	       mono_sub(now, client->active).ns >= STALL_NS;
}

static void serve_client(struct gateway_sockets *gs, struct client *client, mono_t now)
{
	int r = write_client(client, now);

	if (r == 0) {
		r = read_client(client, now);
	}
	if (r == -EPIPE) {
		close_client(gs, client); /* by its own wish */
		return;
	}
	if (r < 0 || client->is_overrun || take_frames(gs, client, now) < 0 ||
	    is_stalled(gs, client, now)) {
		disconnect(gs, client);
	}
}

static void read_datagrams(struct gateway_sockets *gs)
{
	uint8_t bytes[GATEWAY_FRAME_BYTES + 1];
	struct gateway_mail mail;

	for (unsigned n = 0; n < DATAGRAMS_PER_PASS; n++) {
		struct gateway_peer peer = { .connection = 0 };
		socklen_t address_bytes = sizeof(peer.address);
		ssize_t len = recvfrom(gs->udp, bytes, sizeof(bytes), 0,
				       (struct sockaddr *)(void *)&peer.address, &address_bytes);

		if (len < 0) {
			return;
		}
		if (gateway_frame_get(bytes, (size_t)len, &mail) <= 0) {
			gateway_counters(gs->gateway)->malformed++;
		} else {
			gateway_take(gs->gateway, &peer, &mail);
		}
	}
}

/* --- public --- */

void gateway_sockets_service(struct gateway_sockets *gs, const struct gateway_bus *bus, mono_t now)
{
	accept_clients(gs, now);
	read_datagrams(gs);
	for (size_t i = 0; i < GATEWAY_CLIENTS; i++) {
		if (gs->client[i].fd >= 0) {
			serve_client(gs, &gs->client[i], now);
		}
	}
	gateway_step(gs->gateway, bus, now);
}

int gateway_sockets_is_busy(const struct gateway_sockets *gs)
{
	int is_writing = 0;

	for (size_t i = 0; i < GATEWAY_CLIENTS; i++) {
		is_writing |= gs->client[i].fd >= 0 && gs->client[i].out_len > 0;
	}
	return is_writing || gateway_open(gs->gateway) > 0;
}

int gateway_sockets_fd(const struct gateway_sockets *gs)
{
	return gs->poller;
}

struct gateway *gateway_sockets_gateway(struct gateway_sockets *gs)
{
	return gs->gateway;
}

static int open_socket(struct gateway_sockets *gs, const struct sockaddr *address,
		       socklen_t address_bytes, int type, int *ret_fd)
{
	struct epoll_event interest = { .events = EPOLLIN };
	int on = 1;
	int fd = socket(address->sa_family, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);

	if (fd < 0) {
		return -errno;
	}
	*ret_fd = fd;
	if (type == SOCK_STREAM && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)) < 0) {
		return -errno;
	}
	if (type == SOCK_DGRAM) {
		int bytes = UDP_RECEIVE_BYTES;

		setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
	}
	if (bind(fd, address, address_bytes) < 0 ||
	    (type == SOCK_STREAM && listen(fd, BACKLOG) < 0) ||
	    epoll_ctl(gs->poller, EPOLL_CTL_ADD, fd, &interest) < 0) {
		return -errno;
	}
	return 0;
}

static int open_all(struct gateway_sockets *gs, const struct sockaddr *address,
		    socklen_t address_bytes)
{
	const struct gateway_out out = { .send = send_frame, .ctx = gs };
	int r = gateway_create(&out, &gs->gateway);

	if (r < 0) {
		return r;
	}
	gs->poller = epoll_create1(EPOLL_CLOEXEC);
	if (gs->poller < 0) {
		return -errno;
	}
	r = open_socket(gs, address, address_bytes, SOCK_DGRAM, &gs->udp);
	return r < 0 ? r : open_socket(gs, address, address_bytes, SOCK_STREAM, &gs->listener);
}

int gateway_sockets_create(const struct sockaddr *address, socklen_t address_bytes,
			   struct gateway_sockets **ret_sockets, char *error, size_t error_bytes)
{
	struct gateway_sockets *gs = calloc(1, sizeof(*gs));
	int r;

	if (gs == NULL) {
		snprintf(error, error_bytes, "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	gs->poller = -1;
	gs->udp = -1;
	gs->listener = -1;
	for (size_t i = 0; i < GATEWAY_CLIENTS; i++) {
		gs->client[i].fd = -1;
	}
	r = open_all(gs, address, address_bytes);
	if (r < 0) {
		snprintf(error, error_bytes, "%s", strerror(-r));
		gateway_sockets_destroy(gs);
		return r;
	}
	*ret_sockets = gs;
	return 0;
}

static void close_fd(int fd)
{
	if (fd >= 0) {
		close(fd);
	}
}

void gateway_sockets_destroy(struct gateway_sockets *gs)
{
	if (gs == NULL) {
		return;
	}
	gateway_destroy(gs->gateway);
	for (size_t i = 0; i < GATEWAY_CLIENTS; i++) {
		close_fd(gs->client[i].fd);
	}
	close_fd(gs->udp);
	close_fd(gs->listener);
	close_fd(gs->poller);
	free(gs);
}
