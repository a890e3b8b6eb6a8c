/* SPDX-License-Identifier: MIT */
/* ecdaq-web: serves the samples of ecdaqd to browsers and Foxglove viewers, until it is stopped. */
#include <errno.h>
#include <signal.h>
#include <string.h>

#include "base/stop.h"
#include "config/config.h"
#include "program/command_line.h"
#include "program/error.h"
#include "web/server.h"

enum { ERROR_BYTES = 512 };

static const char program[] = "ecdaq-web";

static void report(const char *line)
{
	error_print(program, "%s", line);
}

static enum exit_code code_of(int error)
{
	return error == -EINVAL || error == -EADDRNOTAVAIL ? EXIT_CODE_CONFIG
	       : error == -EADDRINUSE                      ? EXIT_CODE_BUSY
	       : error == -EACCES                          ? EXIT_CODE_PERMISSION
							   : EXIT_CODE_FAILED;
}

static enum exit_code run(struct server *server)
{
	int r = 0;

	while (!stop_requested() && r == 0) {
		r = server_step(server);
	}
	if (r < 0) {
		error_print(program, "%s", strerror(-r));
	}
	return r < 0 ? EXIT_CODE_FAILED : EXIT_CODE_OK;
}

int main(int argc, char **argv)
{
	static struct config cfg;
	struct command_line line = {
		.program = program,
		.summary = "Serves the samples of ecdaqd over HTTP and WebSocket: a page for "
			   "browsers, and the\n"
			   "Foxglove WebSocket protocol. Reads only. Waits for the master and "
			   "follows it through\n"
			   "restarts. Requires web.enable=on.\n",
		.exit_codes = EXIT_CODE_COMMON | EXIT_CODE_BIT(CONFIG) | EXIT_CODE_BIT(PERMISSION) |
			      EXIT_CODE_BIT(BUSY) | EXIT_CODE_BIT(DISABLED),
	};
	const struct sigaction ignore = { .sa_handler = SIG_IGN };
	struct server *server;
	char error[ERROR_BYTES];
	enum exit_code code;
	int r;

	if (command_line_read(&line, argc, argv, &cfg, &code) == COMMAND_LINE_EXIT) {
		return (int)code;
	}
	if (!cfg.web_enable) {
		return (int)command_line_disabled(&line, "web.enable");
	}
	if (line.is_check) {
		return (int)command_line_valid(&line);
	}
	/* A client that is gone is an error of its write, no signal. */
	sigaction(SIGPIPE, &ignore, NULL);
	stop_catch(STOP_REPEAT_IGNORED, NULL);
	r = server_create(&cfg, report, &server, error, sizeof(error));
	if (r < 0) {
		error_print(program, "%s", error);
		return (int)code_of(r);
	}
	code = run(server);
	server_destroy(server);
	return (int)code;
}
