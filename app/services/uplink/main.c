/* SPDX-License-Identifier: MIT */
/* ecdaq-uplink: uploads finished recordings to an object store, until it is stopped. */
#include <errno.h>
#include <signal.h>

#include "base/args.h"
#include "base/stop.h"
#include "config/config.h"
#include "program/command_line.h"
#include "program/error.h"
#include "uplink/uplink.h"

enum { ERROR_BYTES = 512 };

static const char program[] = "ecdaq-uplink";

static void report(const char *line)
{
	error_print(program, "%s", line);
}

int main(int argc, char **argv)
{
	static struct config cfg;
	int is_once = 0;
	const struct args_option options[] = {
		{ "once", 0, args_flag, &is_once, NULL,
		  "exit when all finished recordings are uploaded" },
	};
	struct command_line line = {
		.program = program,
		.summary = "Uploads each finished recording to an object store with the interface "
			   "of S3, once and\n"
			   "verified, and a manifest beside it. Continues where it was "
			   "interrupted. Requires\n"
			   "uplink.enable=on, uplink.endpoint, uplink.bucket and "
			   "uplink.credentials. --check also\n"
			   "reads the file of credentials.\n",
		.options = options,
		.option_count = 1,
		.exit_codes = EXIT_CODE_COMMON | EXIT_CODE_BIT(CONFIG) | EXIT_CODE_BIT(DISABLED),
	};
	const struct sigaction ignore = { .sa_handler = SIG_IGN };
	struct uplink *uplink;
	char error[ERROR_BYTES];
	enum exit_code code;
	int r;

	if (command_line_read(&line, argc, argv, &cfg, &code) == COMMAND_LINE_EXIT) {
		return (int)code;
	}
	if (!cfg.uplink_enable) {
		return (int)command_line_disabled(&line, "uplink.enable");
	}
	/* A server that is gone is an error of its write, no signal. */
	sigaction(SIGPIPE, &ignore, NULL);
	/* Not blocked: a request, which may take hours, ends at stop_requested(). */
	stop_catch(STOP_REPEAT_IGNORED, NULL);
	r = uplink_create(&cfg, report, &uplink, error, sizeof(error));
	if (r < 0) {
		error_print(program, "%s", error);
		return r == -EINVAL ? EXIT_CODE_CONFIG : EXIT_CODE_FAILED;
	}
	while (!line.is_check && !stop_requested()) {
		int64_t wait_ns = uplink_step(uplink);

		if (is_once && uplink_is_idle(uplink)) {
			break;
		}
		stop_wait(wait_ns);
	}
	uplink_destroy(uplink);
	return (int)(line.is_check ? command_line_valid(&line) : EXIT_CODE_OK);
}
