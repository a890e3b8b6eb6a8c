/* SPDX-License-Identifier: MIT */
/* ecdaq-stream: sends the samples and events of ecdaqd to NATS JetStream, until it is stopped. */
#include <errno.h>
#include <signal.h>

#include "base/stop.h"
#include "config/config.h"
#include "program/command_line.h"
#include "program/error.h"
#include "stream/streamer.h"

enum { ERROR_BYTES = 512 };

static const char program[] = "ecdaq-stream";

static void report(const char *line)
{
	error_print(program, "%s", line);
}

int main(int argc, char **argv)
{
	static struct config cfg;
	struct command_line line = {
		.program = program,
		.summary = "Sends every cycle and event of ecdaqd to NATS JetStream, each exactly "
			   "once. Waits for the\n"
			   "master and for the server, and continues where the stream ends: from "
			   "the ring or from\n"
			   "the recordings. Requires stream.enable=on and stream.servers. --check "
			   "also reads the\n"
			   "files of credentials and keys.\n",
		.exit_codes = EXIT_CODE_COMMON | EXIT_CODE_BIT(CONFIG) | EXIT_CODE_BIT(DISABLED),
	};
	const struct sigaction ignore = { .sa_handler = SIG_IGN };
	struct streamer *streamer;
	char error[ERROR_BYTES];
	enum exit_code code;
	int r;

	if (command_line_read(&line, argc, argv, &cfg, &code) == COMMAND_LINE_EXIT) {
		return (int)code;
	}
	if (!cfg.stream_enable) {
		return (int)command_line_disabled(&line, "stream.enable");
	}
	/* A server that is gone is an error of its write, no signal. */
	sigaction(SIGPIPE, &ignore, NULL);
	stop_catch(STOP_REPEAT_IGNORED, NULL);
	stop_block(); /* before the library starts threads */
	r = streamer_create(&cfg, report, &streamer, error, sizeof(error));
	if (r < 0) {
		error_print(program, "%s", error);
		return r == -EINVAL ? EXIT_CODE_CONFIG : EXIT_CODE_FAILED;
	}
	while (!line.is_check && !stop_requested()) {
		stop_wait(streamer_step(streamer));
	}
	streamer_destroy(streamer);
	return (int)(line.is_check ? command_line_valid(&line) : EXIT_CODE_OK);
}
