/* SPDX-License-Identifier: MIT */
#include "cli/admin_client.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

/* ecdaqd ends each request by a time-out of its own; these are a little longer. */
enum { REPLY_TIMEOUT_S = 25, BRING_UP_TIMEOUT_S = 605 };

static int timeout_s(const struct admin_request *request)
{
	return request->verb == ADMIN_RESCAN || (request->verb == ADMIN_STATE &&
						 request->slave_pos == ADMIN_ALL_SLAVES)
		       ? BRING_UP_TIMEOUT_S
		       : REPLY_TIMEOUT_S;
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
		return cli_fail(
			cli, EXIT_CODE_PERMISSION,
			"admin socket: %s: permission denied: run as root or join its group", path);
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

/* 0 with the last reply, or -errno; -EPROTO: not a reply; -ECONNRESET: ecdaqd went away. */
static int exchange(int fd, const struct admin_request *request, struct admin_reply *ret_reply)
{
	struct admin_reply reply;
	ssize_t n = send(fd, request, sizeof(*request), MSG_NOSIGNAL);

	if (n < 0) {
		return -errno;
	}
	do {
		do {
			n = recv(fd, &reply, sizeof(reply), 0);
		} while (n < 0 && errno == EINTR);
		if (n < 0) {
			return -errno;
		}
		if (n == 0) {
			return -ECONNRESET;
		}
		if ((size_t)n != sizeof(reply) || reply.magic != ADMIN_MAGIC ||
		    reply.id != request->id || reply.data_len > ADMIN_DATA_BYTES) {
			return -EPROTO;
		}
	} while (reply.kind != ADMIN_REPLY_DONE);
	reply.text[sizeof(reply.text) - 1] = '\0';
	*ret_reply = reply;
	return 0;
}

enum exit_code admin_ask(struct cli *cli, struct admin_request *request,
			 struct admin_reply *ret_reply)
{
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(cli, CONFIG_RUN_ADMIN, path);
	int fd;
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	fd = connect_to(path, timeout_s(request));
	if (fd < 0) {
		return fail_connect(cli, path, -fd);
	}
	request->magic = ADMIN_MAGIC;
	r = exchange(fd, request, ret_reply);
	close(fd);
	if (r == -EAGAIN) {
		return cli_fail(cli, EXIT_CODE_FAILED, "ecdaqd: no answer within %d s",
				timeout_s(request));
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
