/* SPDX-License-Identifier: MIT */
/* ecdaq web-token: a one-time token for a log-in on the page, from ecdaq-web-command. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/args.h"
#include "base/web_command.h"
#include "cli/cli.h"

enum { REPLY_S = 10, HTTP_OK = 200 };

static const char *const roles[] = { "viewer", "operator", "engineer" };

/* The reply, or -errno. */
static int ask(const char *path, const struct web_request *request, struct web_reply *ret)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	const struct timeval timeout = { .tv_sec = REPLY_S };
	ssize_t n;
	int r = 0;
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
	    connect(fd, (const struct sockaddr *)&address, sizeof(address)) < 0 ||
	    send(fd, request, sizeof(*request), MSG_NOSIGNAL) < 0) {
		r = -errno;
	} else {
		n = recv(fd, ret, sizeof(*ret), 0);
		r = n < 0                                                           ? -errno
		    : n == (ssize_t)sizeof(*ret) && ret->magic == WEB_COMMAND_MAGIC ? 0
										    : -EPROTO;
	}
	close(fd);
	return r;
}

static enum exit_code fail(const struct cli *cli, int error, const char *path)
{
	switch (error) {
	case -ENOENT:
	case -ENOTDIR:
	case -ECONNREFUSED:
		return cli_fail(cli, EXIT_CODE_NO_DAEMON,
				"%s: no answer: is ecdaq-web-command running?", path);
	case -EACCES:
	case -EPERM:
		return cli_fail_permission(cli, "use the socket", path);
	default:
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: %s", path, strerror(-error));
	}
}

static enum exit_code print_token(struct cli *cli, const char *role, int64_t minutes)
{
	struct web_request request = { .magic = WEB_COMMAND_MAGIC, .verb = WEB_TOKEN };
	struct web_reply reply = { .status = 0 };
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(cli, CONFIG_RUN_WEB_TOKEN, path);
	int bytes;
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	snprintf(request.body, sizeof(request.body), "%s\n%d", role, (int)minutes);
	r = ask(path, &request, &reply);
	if (r < 0) {
		return fail(cli, r, path);
	}
	reply.text[sizeof(reply.text) - 1] = '\0';
	bytes = (int)strcspn(reply.text, "\n");
	if (reply.status != HTTP_OK) {
		return cli_fail(cli, EXIT_CODE_REFUSED, "refused: %.*s", bytes, reply.text);
	}
	printf("%.*s\n", bytes, reply.text);
	fflush(stdout);
	explicit_bzero(&reply, sizeof(reply));
	return EXIT_CODE_OK;
}

enum exit_code verb_web_token(struct cli *cli, int argc, char **argv)
{
	struct args_integer minutes = { 1, WEB_TOKEN_MINUTES_MAX, WEB_TOKEN_MINUTES };
	const struct args_option options[] = {
		{ "minutes", 0, args_integer, &minutes, "N",
		  "for how long it is good, 1 to 1440 (default: 10)" },
	};
	struct args args = {
		.options = options, .option_count = 1, .operands_min = 1, .operands_max = 1
	};
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	for (size_t i = 0; i < sizeof(roles) / sizeof(roles[0]); i++) {
		if (strcmp(args.operands[0], roles[i]) == 0) {
			return print_token(cli, roles[i], minutes.value);
		}
	}
	return cli_fail(cli, EXIT_CODE_USAGE, "%s: expected viewer, operator or engineer",
			args.operands[0]);
}
