/* SPDX-License-Identifier: MIT */
/* ecdaq-dds: publishes the samples of ecdaqd over DDS and takes commands, until it is stopped. */
#include <errno.h>

#include "base/stop.h"
#include "config/config.h"
#include "program/command_line.h"
#include "program/error.h"
#include "publish/publisher.h"

enum { ERROR_BYTES = 512 };

static const char program[] = "ecdaq-dds";

static int run(struct publisher *publisher)
{
	char error[ERROR_BYTES];
	int r = 0;

	stop_catch(STOP_REPEAT_IGNORED, NULL);
	while (!stop_requested() && r == 0) {
		r = publisher_step(publisher, error, sizeof(error));
	}
	if (r < 0) {
		error_print(program, "%s", error);
	}
	return r;
}

static enum exit_code code_of(int error)
{
	return error == -EINVAL || error == -ENODEV || error == -ENAMETOOLONG ||
			       error == -EKEYREJECTED
		       ? EXIT_CODE_CONFIG
		       : EXIT_CODE_FAILED;
}

int main(int argc, char **argv)
{
	static struct config cfg;
	struct command_line line = {
		.program = program,
		.summary = "Publishes every cycle of ecdaqd over DDS and forwards commands to it. "
			   "Waits for "
			   "the\n"
			   "master and follows it through restarts. Requires dds.enable=on and "
			   "dds.interface.\n"
			   "--check also looks whether DDS can start.\n",
		.exit_codes = EXIT_CODE_COMMON | EXIT_CODE_BIT(CONFIG) | EXIT_CODE_BIT(DISABLED),
	};
	struct publisher *publisher;
	char error[ERROR_BYTES];
	enum exit_code code;
	int r;

	if (command_line_read(&line, argc, argv, &cfg, &code) == COMMAND_LINE_EXIT) {
		return (int)code;
	}
	if (!cfg.dds_enable) {
		return (int)command_line_disabled(&line, "dds.enable");
	}
	r = publisher_create(&cfg, &publisher, error, sizeof(error));
	if (r < 0) {
		error_print(program, "%s", error);
		return (int)code_of(r);
	}
	r = line.is_check ? 0 : run(publisher);
	publisher_destroy(publisher);
	if (r < 0) {
		return (int)code_of(r);
	}
	return (int)(line.is_check ? command_line_valid(&line) : EXIT_CODE_OK);
}
