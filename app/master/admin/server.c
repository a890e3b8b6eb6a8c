/* SPDX-License-Identifier: MIT */
#include "admin/server.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "admin/pending.h"
#include "base/listener.h"

/* Messages read from a client in one pass, and requests that it may have open. */
enum { READS_PER_PASS = 16, OPEN_PER_CLIENT = 8 };
/* One more client than ADMIN_CLIENTS, so that PING and STOP always find a place. */
enum { CLIENT_SLOTS = ADMIN_CLIENTS + 1, URGENT = ADMIN_CLIENTS };
/* Data of requests that are held at the same time. */
#define UPLOAD_BYTES_MAX (UINT64_C(2) * ADMIN_TRANSFER_BYTES)
/* A client that takes no message of an answer for this long is closed. */
#define STALL_NS (2 * NS_PER_S)

struct client {
	int fd; /* -1: free */
	uint32_t uid;
	int is_stalled;
	mono_t stalled_since;
};

struct admin_server {
	int poller;
	struct listener admin;
	struct listener offer; /* of the board */
	int board_fd;
	struct client client[CLIENT_SLOTS];
	struct admin_pending pending[ADMIN_PENDING];
	size_t first;       /* of pending[], in the next pass */
	int is_frame_taken; /* in this pass */
	int is_silent;      /* no socket has anything for the next pass */
};

/* One pass. */
struct pass {
	struct admin_server *server;
	const struct admin_target *target;
	mono_t now;
};

static int fail(char *error, size_t error_bytes, const char *path, int r)
{
	snprintf(error, error_bytes, "admin socket %s: %s", path, strerror(-r));
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
	for (size_t i = 0; i < CLIENT_SLOTS; i++) {
		server->client[i].fd = -1;
	}
	server->poller = epoll_create1(EPOLL_CLOEXEC);
	r = server->poller < 0 ? -errno
			       : listener_open(&server->admin, path, group, server->poller);
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
	int r = listener_open(&server->offer, path, group, server->poller);

	server->board_fd = board_fd;
	return r < 0 ? fail(error, error_bytes, path, r) : 0;
}

/* --- requests without a client --- */

/* Nobody waits for it any more: it is released when its executor has completed it. */
static void abandon(struct admin_pending *pending)
{
	pending->client = NULL;
	if (pending->state == ADMIN_PENDING_OPEN && !pending->is_cancelled) {
		pending->is_cancelled = 1;
		if (pending->cancel != NULL) {
			pending->cancel(pending);
		}
	}
	if (pending->state != ADMIN_PENDING_OPEN) {
		admin_pending_release(pending);
	}
}

static void client_close(struct admin_server *server, struct client *client)
{
	close(client->fd); /* leaves the poller with it */
	client->fd = -1;
	for (size_t i = 0; i < ADMIN_PENDING; i++) {
		struct admin_pending *pending = &server->pending[i];

		if (pending->state != ADMIN_PENDING_FREE && pending->client == client) {
			abandon(pending);
		}
	}
}

void admin_server_cancel_all(struct admin_server *server)
{
	for (size_t i = 0; i < ADMIN_PENDING; i++) {
		struct admin_pending *pending = &server->pending[i];

		if (pending->state == ADMIN_PENDING_QUEUED) {
			admin_pending_complete(pending, -ECANCELED);
		} else if (pending->state == ADMIN_PENDING_OPEN && !pending->is_cancelled &&
			   !pending->outlives_bus) {
			pending->is_cancelled = 1;
			if (pending->cancel != NULL) {
				pending->cancel(pending);
			}
		}
	}
}

void admin_server_destroy(struct admin_server *server)
{
	if (server == NULL) {
		return;
	}
	for (size_t i = 0; i < CLIENT_SLOTS; i++) {
		if (server->client[i].fd >= 0) {
			client_close(server, &server->client[i]);
		}
	}
	for (size_t i = 0; i < ADMIN_PENDING; i++) {
		admin_pending_release(&server->pending[i]);
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

/* --- answers --- */

/* 1 sent, 0 not now, -1 the client is gone. */
static int post(const struct client *client, const struct admin_reply *reply)
{
	ssize_t n = send(client->fd, reply, sizeof(*reply), MSG_NOSIGNAL | MSG_DONTWAIT);

	if (n == (ssize_t)sizeof(*reply)) {
		return 1;
	}
	return n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOBUFS) ? 0 : -1;
}

/* An answer that no pending request stands for: a client that does not take it is closed. */
static void answer_at_once(const struct pass *pass, struct client *client, uint32_t id, int result,
			   const char *text)
{
	struct admin_reply reply = { .magic = ADMIN_MAGIC, .id = id, .result = result };

	snprintf(reply.text, sizeof(reply.text), "%s", text);
	if (post(client, &reply) != 1) {
		client_close(pass->server, client);
	}
}

static void send_progress(struct admin_pending *pending)
{
	struct admin_reply reply = pending->reply;

	reply.kind = ADMIN_REPLY_PROGRESS;
	reply.data_len = 0;
	if (post(pending->client, &reply) != 0) {
		pending->has_progress = 0; /* a client that is gone is found by its socket */
	}
}

/* As much of the answer as the client takes now. */
static void send_answer(const struct pass *pass, struct admin_pending *pending)
{
	struct client *client = pending->client;
	struct admin_reply message;
	int r;

	admin_command_report(pass->target, pending);
	if (client == NULL) {
		admin_pending_release(pending);
		return;
	}
	do {
		admin_pending_next(pending, &message);
		r = post(client, &message);
		if (r == 1 && admin_pending_has_sent(pending, &message)) {
			admin_pending_release(pending);
			client->is_stalled = 0;
			return;
		}
		client->is_stalled = client->is_stalled && r != 1;
	} while (r == 1);
	if (r == 0 && !client->is_stalled) {
		client->is_stalled = 1;
		client->stalled_since = pass->now;
	}
	if (r < 0 || mono_sub(pass->now, client->stalled_since).ns >= STALL_NS) {
		client_close(pass->server, client);
	}
}

/* --- requests --- */

static struct admin_pending *find_open(struct admin_server *server, const struct client *client,
				       uint32_t id)
{
	for (size_t i = 0; i < ADMIN_PENDING; i++) {
		struct admin_pending *pending = &server->pending[i];

		if (pending->state != ADMIN_PENDING_FREE && pending->client == client &&
		    pending->request.id == id) {
			return pending;
		}
	}
	return NULL;
}

/* A place for one more request of @client; else the refusal. */
static struct admin_pending *find_place(const struct pass *pass, struct client *client,
					const struct admin_request *rq)
{
	struct admin_pending *place = NULL;
	unsigned own = 0;
	uint64_t held_bytes = rq->data_total;

	for (size_t i = 0; i < ADMIN_PENDING; i++) {
		struct admin_pending *pending = &pass->server->pending[i];

		if (pending->state == ADMIN_PENDING_FREE) {
			place = pending;
			continue;
		}
		own += (unsigned)(pending->client == client);
		held_bytes += pending->upload != NULL ? pending->request.data_total : 0;
	}
	if (find_open(pass->server, client, rq->id) != NULL) {
		answer_at_once(pass, client, rq->id, -EEXIST, "a request of this id is still open");
		return NULL;
	}
	if (place == NULL || own >= OPEN_PER_CLIENT || held_bytes > UPLOAD_BYTES_MAX) {
		answer_at_once(pass, client, rq->id, -EBUSY,
			       own >= OPEN_PER_CLIENT
				       ? "too many requests of this client are open"
				       : "too many requests are open (ADMIN_PENDING)");
		return NULL;
	}
	return place;
}

/* 1 if @pending may go on in this pass: however many clients ask for frames, the bus is not kept
 * waiting for more than one of them. */
static int take_turn(struct admin_server *server, const struct admin_pending *pending)
{
	if (!admin_command_takes_frame((enum admin_verb)pending->request.verb)) {
		return 1;
	}
	if (server->is_frame_taken) {
		return 0;
	}
	server->is_frame_taken = 1;
	server->first = (size_t)(pending - server->pending) + 1;
	return 1;
}

static void start(const struct pass *pass, struct admin_pending *pending)
{
	if (!take_turn(pass->server, pending)) {
		pending->state = ADMIN_PENDING_QUEUED;
		return;
	}
	pending->state = ADMIN_PENDING_OPEN;
	admin_command_run(pass->target, pending);
}

static void execute(const struct pass *pass, struct admin_pending *pending)
{
	int64_t limit_ns = pending->state == ADMIN_PENDING_OPEN
				   ? admin_timeout_ns(&pending->request)
				   : ADMIN_DATA_TIMEOUT_NS;

	pending->give_up = mono_add(pass->now, (span_t){ limit_ns });
	if (pending->state == ADMIN_PENDING_OPEN) {
		start(pass, pending);
	}
	if (pending->state == ADMIN_PENDING_COMPLETE) {
		send_answer(pass, pending);
	}
}

static void begin(const struct pass *pass, struct client *client, const struct admin_request *rq)
{
	struct admin_pending *pending;

	if (rq->verb == ADMIN_PING || rq->verb == ADMIN_STOP) {
		struct admin_pending urgent; /* never waits, also for no place */

		admin_pending_init(&urgent, rq, client->uid);
		admin_command_run(pass->target, &urgent);
		answer_at_once(pass, client, rq->id, urgent.reply.result, urgent.reply.text);
		admin_pending_release(&urgent);
		return;
	}
	if (client == &pass->server->client[URGENT]) {
		answer_at_once(pass, client, rq->id, -EBUSY, "too many clients (ADMIN_CLIENTS)");
		if (client->fd >= 0) {
			client_close(pass->server, client);
		}
		return;
	}
	pending = find_place(pass, client, rq);
	if (pending == NULL) {
		return;
	}
	if (admin_pending_init(pending, rq, client->uid) < 0) {
		answer_at_once(pass, client, rq->id, -ENOMEM, "no memory for the data");
		return;
	}
	pending->client = client;
	execute(pass, pending);
}

/* The request ends with @result; its executor goes on until it has undone what is to undo. */
static void end_early(const struct pass *pass, struct admin_pending *pending, int result,
		      const char *text)
{
	struct client *client = pending->client;
	uint32_t id = pending->request.id;

	abandon(pending);
	answer_at_once(pass, client, id, result, text);
}

static void continue_request(const struct pass *pass, struct client *client,
			     const struct admin_request *rq)
{
	struct admin_pending *pending = find_open(pass->server, client, rq->id);

	if (pending == NULL) {
		answer_at_once(pass, client, rq->id, -ENOENT, "no open request of this id");
	} else if (rq->verb == ADMIN_CANCEL) {
		if (pending->state != ADMIN_PENDING_COMPLETE) {
			end_early(pass, pending, -ECANCELED, "cancelled by the client");
		}
	} else if (admin_pending_collect(pending, rq) < 0) {
		end_early(pass, pending, -EINVAL, "these are not the next data of the request");
	} else {
		execute(pass, pending);
	}
}

static void handle(const struct pass *pass, struct client *client, const void *message, size_t len)
{
	struct admin_request request;
	char why[ADMIN_TEXT_BYTES];
	int r = admin_request_parse(message, len, &request, why);

	if (r < 0) {
		uint32_t id = 0;

		if (r == -EINVAL) {
			memcpy(&id, (const uint8_t *)message + offsetof(struct admin_request, id),
			       sizeof(id));
		}
		answer_at_once(pass, client, id, r, why);
		/* A client that violates the protocol is disconnected. */
		if (r != -EINVAL && client->fd >= 0) {
			client_close(pass->server, client);
		}
		return;
	}
	if (request.verb == ADMIN_CANCEL || request.verb == ADMIN_DATA) {
		continue_request(pass, client, &request);
	} else {
		begin(pass, client, &request);
	}
}

/* 1 if there may be more. */
static int read_client(const struct pass *pass, struct client *client)
{
	struct admin_request message;
	ssize_t len = recv(client->fd, &message, sizeof(message), MSG_DONTWAIT | MSG_TRUNC);

	if (len < 0 && (errno == EAGAIN || errno == EINTR)) {
		return 0;
	}
	if (len <= 0) {
		client_close(pass->server, client);
		return 0;
	}
	handle(pass, client, &message, (size_t)len);
	return client->fd >= 0;
}

/* --- clients --- */

static struct client *free_client(struct admin_server *server)
{
	for (size_t i = 0; i < ADMIN_CLIENTS; i++) {
		if (server->client[i].fd < 0) {
			return &server->client[i];
		}
	}
	/* Whoever had the urgent place has had its chance: its requests are answered at once. */
	if (server->client[URGENT].fd >= 0) {
		client_close(server, &server->client[URGENT]);
	}
	return &server->client[URGENT];
}

static void accept_clients(const struct pass *pass)
{
	struct admin_server *server = pass->server;
	struct ucred peer = { .uid = (uid_t)-1 };
	socklen_t peer_bytes = sizeof(peer);
	struct epoll_event interest = { .events = EPOLLIN };
	int fd;

	while ((fd = accept4(server->admin.fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0) {
		struct client *client = free_client(server);

		peer_bytes = sizeof(peer);
		if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &peer_bytes) < 0 ||
		    epoll_ctl(server->poller, EPOLL_CTL_ADD, fd, &interest) < 0) {
			close(fd);
			continue;
		}
		*client = (struct client){ .fd = fd, .uid = peer.uid };
		if (client == &server->client[URGENT]) {
			read_client(pass, client);
		}
	}
}

static void serve_offer(const struct admin_server *server)
{
	int fd;

	for (int n = 0; server->offer.fd >= 0 && n < ADMIN_CLIENTS; n++) {
		fd = accept4(server->offer.fd, NULL, NULL, SOCK_CLOEXEC);
		if (fd < 0) {
			return;
		}
		listener_give_fd(fd, server->board_fd);
		close(fd);
	}
}

static const char *late_text(const struct admin_pending *pending)
{
	if (pending->state == ADMIN_PENDING_COLLECTING) {
		return "the rest of its data did not come in time";
	}
	if (pending->waits_for != NULL) {
		return pending->waits_for;
	}
	return pending->request.verb == ADMIN_SET || pending->request.verb == ADMIN_ONESHOT
		       ? "withdrawn: no frame came back with the values in time, or the outputs "
			 "are at fail-safe"
		       : "not answered in time";
}

static void go_on(const struct pass *pass, struct admin_pending *pending)
{
	if (pending->state == ADMIN_PENDING_QUEUED) {
		start(pass, pending);
	} else if (pending->state == ADMIN_PENDING_OPEN && pending->poll != NULL &&
		   take_turn(pass->server, pending)) {
		pending->poll(pending, pass->target);
	}
}

static int is_open(const struct admin_pending *pending)
{
	return pending->state == ADMIN_PENDING_OPEN || pending->state == ADMIN_PENDING_QUEUED;
}

/* 1 if it has to be looked at again soon. */
static int attend(const struct pass *pass, struct admin_pending *pending)
{
	go_on(pass, pending);
	if ((is_open(pending) || pending->state == ADMIN_PENDING_COLLECTING) &&
	    pending->client != NULL && pass->now.ns >= pending->give_up.ns) {
		end_early(pass, pending, -ETIMEDOUT, late_text(pending));
	}
	if (pending->state == ADMIN_PENDING_OPEN && pending->client != NULL &&
	    pending->has_progress) {
		send_progress(pending);
	}
	if (pending->state == ADMIN_PENDING_COMPLETE) {
		send_answer(pass, pending);
	}
	return is_open(pending) || pending->state == ADMIN_PENDING_COMPLETE;
}

static void ask_sockets(const struct pass *pass)
{
	struct admin_server *server = pass->server;

	serve_offer(server);
	accept_clients(pass);
	for (size_t i = 0; i < CLIENT_SLOTS; i++) {
		struct client *client = &server->client[i];

		for (int n = 0; n < READS_PER_PASS && client->fd >= 0; n++) {
			if (!read_client(pass, client)) {
				break;
			}
		}
	}
}

void admin_server_note_silence(struct admin_server *server)
{
	server->is_silent = 1;
}

unsigned admin_server_service(struct admin_server *server, const struct admin_target *target,
			      mono_t now)
{
	const struct pass pass = { .server = server, .target = target, .now = now };
	size_t first = server->first;
	unsigned waiting = 0;

	server->is_frame_taken = 0;
	if (!server->is_silent) {
		ask_sockets(&pass);
	}
	server->is_silent = 0;
	for (size_t i = 0; i < ADMIN_PENDING; i++) {
		waiting += (unsigned)attend(&pass, &server->pending[(first + i) % ADMIN_PENDING]);
	}
	return waiting;
}
