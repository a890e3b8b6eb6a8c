/* SPDX-License-Identifier: MIT */
#include "cli/admin_client.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/host_clock.h"
#include "base/stop.h"
#include "program/progress.h"

/* ecdaqd ends each request by a time-out; the answer to that must come within this. */
enum { REPLY_MARGIN_S = 5 };
/* Interval at which a request to stop is checked. */
enum { STOP_CHECK_MS = 200 };
enum { READ_TRIES = 3 };

static int timeout_s(const struct admin_request *request)
{
	return (int)(admin_timeout_ns(request) / NS_PER_S) + REPLY_MARGIN_S;
}

static enum exit_code fail_connect(const struct cli *cli, const char *path, int err)
{
	switch (err) {
	case ENOENT:
	case ENOTDIR:
	case ECONNREFUSED:
		return cli_fail(cli, EXIT_CODE_NO_DAEMON,
				"admin socket: %s: no answer: is ecdaqd running?", path);
	case EACCES:
	case EPERM:
		return cli_fail_permission(cli, "use the admin socket", path);
	default:
		return cli_fail(cli, EXIT_CODE_FAILED, "admin socket: %s: %s", path, strerror(err));
	}
}

static int connect_to(const char *path, int reply_timeout_s)
{
	struct timeval timeout = { .tv_sec = reply_timeout_s };
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd;

	if (strlen(path) >= sizeof(address.sun_path)) {
		return -ENAMETOOLONG;
	}
	memcpy(address.sun_path, path, strlen(path) + 1);
	fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
	if (fd < 0) {
		return -errno;
	}
	if (setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout)) < 0 ||
	    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof(timeout)) < 0 ||
	    connect(fd, (const struct sockaddr *)&address, sizeof(address)) < 0) {
		int r = -errno;

		close(fd);
		return r;
	}
	return fd;
}

static int post(int fd, const struct admin_request *message)
{
	ssize_t n;

	do {
		n = send(fd, message, sizeof(*message), MSG_NOSIGNAL);
	} while (n < 0 && errno == EINTR);
	return n < 0 ? -errno : 0;
}

/* The request, and what does not fit into its first message. */
static int send_all(int fd, const struct admin_transfer *tr)
{
	struct admin_request message = *tr->request;
	size_t sent = message.data_len;
	int r;

	if (tr->data != NULL) {
		sent = tr->data_len < ADMIN_DATA_BYTES ? tr->data_len : ADMIN_DATA_BYTES;
		memcpy(message.data, tr->data, sent);
		message.data_len = (uint32_t)sent;
		message.data_total = (uint32_t)tr->data_len;
	}
	r = post(fd, &message);
	message.verb = ADMIN_DATA;
	while (r == 0 && tr->data != NULL && sent < tr->data_len) {
		size_t left = tr->data_len - sent;

		message.data_offset = (uint32_t)sent;
		message.data_len = (uint32_t)(left < ADMIN_DATA_BYTES ? left : ADMIN_DATA_BYTES);
		memcpy(message.data, tr->data + sent, message.data_len);
		r = post(fd, &message);
		sent += message.data_len;
	}
	return r;
}

/* Ctrl-C: cancel the request once, then wait for its answer. 0 or -errno. */
static int cancel(int fd, struct admin_transfer *tr)
{
	struct admin_request message = { .magic = ADMIN_MAGIC,
					 .verb = ADMIN_CANCEL,
					 .id = tr->request->id };

	if (!tr->can_cancel || !stop_requested()) {
		return 0;
	}
	tr->can_cancel = 0;
	return post(fd, &message);
}

/* Until there is a message. 0; -EAGAIN: not in time. */
static int wait_message(int fd, struct admin_transfer *tr)
{
	struct pollfd pfd = { .fd = fd, .events = POLLIN };

	for (int left_ms = timeout_s(tr->request) * 1000; left_ms > 0; left_ms -= STOP_CHECK_MS) {
		int r = cancel(fd, tr);
		int n = r < 0 ? r : poll(&pfd, 1, STOP_CHECK_MS);

		if (r < 0 || n > 0 || (n < 0 && errno != EINTR)) {
			return r < 0 ? r : n > 0 ? 0 : -errno;
		}
	}
	return -EAGAIN;
}

/* One message of the answer. 0 or -errno. */
static int receive(int fd, struct admin_transfer *tr)
{
	struct admin_reply *reply = &tr->reply;
	ssize_t n;
	int r = wait_message(fd, tr);

	if (r < 0) {
		return r;
	}
	n = recv(fd, reply, sizeof(*reply), 0);
	if (n < 0) {
		return -errno;
	}
	if (n == 0) {
		return -ECONNRESET;
	}
	if ((size_t)n != sizeof(*reply) || reply->magic != ADMIN_MAGIC ||
	    reply->id != tr->request->id || reply->data_len > ADMIN_DATA_BYTES) {
		return -EPROTO;
	}
	reply->text[sizeof(reply->text) - 1] = '\0';
	return 0;
}

/* Data of an answer in several messages, or of the only one. 0 or -errno. */
static int gather(struct admin_transfer *tr, const struct admin_reply *reply)
{
	uint8_t *room;
	size_t len;

	if (reply->kind == ADMIN_REPLY_PROGRESS || reply->data_len == 0) {
		return 0;
	}
	len = tr->answer_len + reply->data_len;
	if (reply->data_offset != tr->answer_len || len > ADMIN_TRANSFER_BYTES) {
		return -EPROTO;
	}
	room = realloc(tr->answer, len);
	if (room == NULL) {
		return -ENOMEM;
	}
	memcpy(room + tr->answer_len, reply->data, reply->data_len);
	tr->answer = room;
	tr->answer_len = len;
	return 0;
}

/* How far it is; @begun: it was called before. */
static void show_progress(const struct admin_transfer *tr, int begun)
{
	if (tr->what == NULL) {
		return;
	}
	if (!begun) {
		progress_begin_of(tr->what[0] != '\0' ? tr->what : "transfer", tr->reply.total,
				  tr->unit);
	}
	progress_at(tr->reply.done);
}

/* 0 with the last reply, or -errno; -EPROTO: not a reply; -ECONNRESET: ecdaqd went away. */
static int take_answer(int fd, struct admin_transfer *tr, uint32_t *ret_total)
{
	int begun = 0;
	int r = 0;

	while (r == 0) {
		r = receive(fd, tr);
		r = r == 0 ? gather(tr, &tr->reply) : r;
		if (r == 0 && tr->reply.kind == ADMIN_REPLY_DONE) {
			return 0;
		}
		if (r == 0 && tr->reply.kind == ADMIN_REPLY_PROGRESS) {
			show_progress(tr, begun);
			begun = 1;
			*ret_total = tr->reply.total != 0 ? tr->reply.total : tr->reply.done;
		}
	}
	return r;
}

/* The request, its progress, its answer. 0 or -errno, as above. */
static int exchange(int fd, struct admin_transfer *tr)
{
	int64_t start_ns = host_clock_ns(CLOCK_MONOTONIC);
	uint32_t total = 0;
	int r = send_all(fd, tr);

	r = r == 0 ? take_answer(fd, tr, &total) : r;
	/* What was not shown may be a part of longer work that is. */
	if (tr->what != NULL && progress_end() && r == 0 && tr->reply.result >= 0) {
		progress_done(start_ns, "%s: %u %s", tr->what[0] != '\0' ? tr->what : "transfer",
			      total, tr->unit != NULL ? tr->unit : "bytes");
	}
	return r;
}

/* The outcome @r of an exchange, reported. */
static enum exit_code judge_exchange(const struct cli *cli, const struct admin_transfer *tr, int r)
{
	if (r == -EAGAIN) {
		return cli_fail(cli, EXIT_CODE_FAILED, "ecdaqd: no answer within %d s",
				timeout_s(tr->request));
	}
	if (r == -EPROTO) {
		return cli_fail(cli, EXIT_CODE_FAILED,
				"ecdaqd: the answer is from another version of ecdaq");
	}
	if (r == -ECONNRESET || r == -EPIPE) {
		return cli_fail(cli, EXIT_CODE_NO_DAEMON,
				"ecdaqd: connection closed without an answer");
	}
	return r < 0 ? cli_fail(cli, EXIT_CODE_FAILED, "ecdaqd: %s", strerror(-r)) : EXIT_CODE_OK;
}

enum exit_code admin_transfer(struct cli *cli, struct admin_transfer *tr)
{
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(cli, CONFIG_RUN_ADMIN, path);
	int fd;
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	fd = connect_to(path, timeout_s(tr->request));
	if (fd < 0) {
		return fail_connect(cli, path, -fd);
	}
	tr->request->magic = ADMIN_MAGIC;
	r = exchange(fd, tr);
	close(fd);
	return judge_exchange(cli, tr, r);
}

enum exit_code admin_transfer_read(struct cli *cli, struct admin_transfer *tr)
{
	unsigned tries = READ_TRIES;
	enum exit_code result;

	do {
		admin_transfer_done(tr);
		tr->answer_len = 0;
		result = admin_transfer(cli, tr);
	} while (result == EXIT_CODE_OK && tr->reply.result == -ETIMEDOUT && --tries > 0);
	return result;
}

enum exit_code admin_transfer_do(struct cli *cli, struct admin_transfer *tr)
{
	enum exit_code result = admin_transfer(cli, tr);

	return result == EXIT_CODE_OK ? admin_judge(cli, &tr->reply) : result;
}

void admin_transfer_done(struct admin_transfer *tr)
{
	free(tr->answer);
	tr->answer = NULL;
}

enum exit_code admin_hold(struct cli *cli, struct admin_request *request, int *ret_fd)
{
	struct admin_transfer tr = { .request = request };
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(cli, CONFIG_RUN_ADMIN, path);
	int fd;
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	fd = connect_to(path, ADMIN_TIMEOUT_S);
	if (fd < 0) {
		return fail_connect(cli, path, -fd);
	}
	request->magic = ADMIN_MAGIC;
	r = send_all(fd, &tr);
	r = r == 0 ? receive(fd, &tr) : r;
	result = judge_exchange(cli, &tr, r);
	if (result == EXIT_CODE_OK && tr.reply.kind != ADMIN_REPLY_PROGRESS) {
		result = admin_judge(cli, &tr.reply);
	}
	if (result != EXIT_CODE_OK) {
		close(fd);
		return result;
	}
	*ret_fd = fd;
	return EXIT_CODE_OK;
}

int admin_hold_has_ended(int fd)
{
	struct pollfd pfd = { .fd = fd, .events = POLLIN };

	return poll(&pfd, 1, 0) > 0;
}

void admin_hold_end(int fd)
{
	if (fd >= 0) {
		close(fd);
	}
}

enum exit_code admin_ask(struct cli *cli, struct admin_request *request,
			 struct admin_reply *ret_reply)
{
	struct admin_transfer tr = { .request = request };
	enum exit_code result = admin_transfer(cli, &tr);

	if (result == EXIT_CODE_OK) {
		*ret_reply = tr.reply;
	}
	admin_transfer_done(&tr);
	return result;
}

enum exit_code admin_judge(const struct cli *cli, const struct admin_reply *reply)
{
	if (reply->result >= 0) {
		return EXIT_CODE_OK;
	}
	return cli_fail(cli, EXIT_CODE_REFUSED, "refused: %s",
			reply->text[0] != '\0' ? reply->text : strerror(-reply->result));
}

enum exit_code admin_do(struct cli *cli, struct admin_request *request,
			struct admin_reply *ret_reply)
{
	enum exit_code result = admin_ask(cli, request, ret_reply);

	return result == EXIT_CODE_OK ? admin_judge(cli, ret_reply) : result;
}
