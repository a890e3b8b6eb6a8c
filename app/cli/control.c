/* SPDX-License-Identifier: MIT */
/* ecdaq stop, ecdaq clear */
#include <stdio.h>

#include "base/clock.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "program/args_duration.h"
#include "reader/page.h"

enum exit_code verb_clear(struct cli *cli, int argc, char **argv)
{
	struct args args = { .options = NULL };
	struct admin_request request = { .verb = ADMIN_CLEAR };
	struct admin_reply reply;
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	return admin_do(cli, &request, &reply);
}

/* Wait for the end of process @pid, at most @wait_ns. */
static enum exit_code wait_for_end(const struct cli *cli, int64_t pid, int64_t wait_ns)
{
	const int64_t step_ns = 20 * NS_PER_MS;
	char why[32];

	for (int64_t waited_ns = 0; page_is_alive(pid); waited_ns += step_ns) {
		if (waited_ns >= wait_ns || screen_is_over()) {
			snprintf(why, sizeof(why), "%.3g s", (double)waited_ns / 1e9);
			return cli_fail(cli, EXIT_CODE_FAILED, "ecdaqd: still running after %s",
					why);
		}
		screen_wait(step_ns);
	}
	return EXIT_CODE_OK;
}

enum exit_code verb_stop(struct cli *cli, int argc, char **argv)
{
	int64_t wait_ns = 0;
	const struct args_option options[] = {
		{ "wait", 0, args_duration, &wait_ns, "T", "wait at most T for ecdaqd to end" },
	};
	struct args args = { .options = options, .option_count = 1 };
	struct admin_request request = { .verb = ADMIN_STOP };
	const struct status_page *page;
	struct admin_reply reply;
	enum exit_code result;
	int64_t pid = 0;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (wait_ns > 0) {
		result = source_status(cli, &page);
		if (result != EXIT_CODE_OK) {
			return result;
		}
		pid = page->pid;
		source_status_close(page);
	}
	result = admin_do(cli, &request, &reply);
	if (result == EXIT_CODE_OK && wait_ns > 0) {
		screen_catch_signals();
		result = wait_for_end(cli, pid, wait_ns);
	}
	return result;
}
