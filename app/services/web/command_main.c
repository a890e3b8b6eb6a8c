/* SPDX-License-Identifier: MIT */
/* ecdaq-web-command: log-in, roles and commands of the page that ecdaq-web serves. */
#include <errno.h>
#include <signal.h>
#include <string.h>
#include <sys/prctl.h>

#include "base/stop.h"
#include "config/config.h"
#include "program/command_line.h"
#include "program/error.h"
#include "web/command_server.h"

enum { ERROR_BYTES = 512 };

static const char program[] = "ecdaq-web-command";

static void report(const char *line)
{
	error_print(program, "%s", line);
}

static enum exit_code code_of(int error)
{
	return error == -EACCES || error == -EPERM ? EXIT_CODE_PERMISSION
	       : error == -ENOENT || error == -ENAMETOOLONG || error == -EINVAL ? EXIT_CODE_CONFIG
										: EXIT_CODE_FAILED;
}

int main(int argc, char **argv)
{
	static struct config cfg;
	struct command_line line = {
		.program = program,
		.summary =
			"Log-in, roles and commands of the page that ecdaq-web serves. It has no "
			"network: ecdaq-web\n"
			"passes requests on to it through a socket in the run directory. Log-in is "
			"by a token of\n"
			"`ecdaq web-token`. Requires web.enable=on.\n",
		.exit_codes = EXIT_CODE_COMMON | EXIT_CODE_BIT(CONFIG) | EXIT_CODE_BIT(PERMISSION) |
			      EXIT_CODE_BIT(DISABLED),
	};
	const struct sigaction ignore = { .sa_handler = SIG_IGN };
	struct command_server *server;
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
	/* Secrets are in its memory: no core file, no debugger of another process. */
	(void)prctl(PR_SET_DUMPABLE, 0);
	sigaction(SIGPIPE, &ignore, NULL);
	stop_catch(STOP_REPEAT_IGNORED, NULL);
	r = command_server_create(&cfg, report, &server, error, sizeof(error));
	if (r < 0) {
		error_print(program, "%s", error);
		return (int)code_of(r);
	}
	while (!stop_requested() && r == 0) {
		r = command_server_step(server);
	}
	command_server_destroy(server);
	if (r < 0) {
		error_print(program, "%s", strerror(-r));
	}
	return r < 0 ? EXIT_CODE_FAILED : EXIT_CODE_OK;
}
