/* SPDX-License-Identifier: MIT */
/* ecdaq-sync0: checks the SYNC0 pulses of the slaves on GPIO lines, until it is stopped. */
#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>

#include "base/stop.h"
#include "config/config.h"
#include "program/command_line.h"
#include "program/error.h"
#include "sync0/calibrate_live.h"
#include "sync0/replay.h"
#include "sync0/watch.h"

enum { ERROR_BYTES = 512 };

static const char program[] = "ecdaq-sync0";

struct arguments {
	const char *edges;
	const char *replay;
	const char *dump;
	const char *dev_dir;
	int is_calibrate;
	int is_json;
};

/* 1 if the options exclude each other: reported. */
static int is_conflict(const struct arguments *a)
{
	const char *message = NULL;

	if (a->is_json && a->replay == NULL) {
		message = "--json: requires --replay (else: ecdaq sync0 --json)";
	} else if (a->dump != NULL && (a->replay != NULL || a->is_calibrate)) {
		message = "--dump: cannot be combined with --replay or --calibrate";
	} else if (a->edges != NULL && (a->replay != NULL || a->is_calibrate)) {
		message = "--edges: cannot be combined with --replay or --calibrate";
	}
	if (message != NULL) {
		error_print(program, "%s", message);
	}
	return message != NULL;
}

/* Its own core, or any but the cycle's: the check must never be in the way of what it checks. */
static void choose_core(const struct config *cfg)
{
	cpu_set_t set;

	if (sched_getaffinity(0, sizeof(set), &set) < 0) {
		return;
	}
	if (cfg->sync0_cpu >= 0) {
		CPU_ZERO(&set);
		CPU_SET((unsigned)cfg->sync0_cpu, &set);
	} else if (cfg->cycle_cpu >= 0 && CPU_COUNT(&set) > 1) {
		CPU_CLR((unsigned)cfg->cycle_cpu, &set);
	} else {
		return;
	}
	if (sched_setaffinity(0, sizeof(set), &set) < 0) {
		error_print(program, "sync0.cpu: %s", strerror(errno));
	}
}

static enum exit_code code_of(int error)
{
	return error == -EACCES || error == -EPERM ? EXIT_CODE_PERMISSION
	       : error == -EBUSY                   ? EXIT_CODE_BUSY
						   : EXIT_CODE_FAILED;
}

static enum exit_code run_replay(const struct arguments *a, const struct config *cfg)
{
	const struct replay_spec spec = {
		.cfg = cfg,
		.path = a->replay,
		.form = a->is_json ? REPLAY_JSON : REPLAY_TEXT,
		.out = stdout,
	};
	enum replay_outcome outcome = REPLAY_GOOD;
	char why[ERROR_BYTES] = "";
	int r = a->is_calibrate ? replay_calibrate(a->replay, cfg->sync0_calibration, stdout, why)
				: replay(&spec, &outcome, why);

	if (r == 0 && fflush(stdout) != 0) {
		r = -errno;
		snprintf(why, sizeof(why), "standard output: %s", strerror(-r));
	}
	if (r < 0) {
		error_print(program, "%s", why);
		return code_of(r);
	}
	return outcome == REPLAY_BAD ? EXIT_CODE_CHECK_FAILED : EXIT_CODE_OK;
}

static enum exit_code run_calibration(const struct config *cfg, const char *dev_dir)
{
	char why[ERROR_BYTES] = "";
	int r = calibrate_live(cfg, dev_dir, stop_flag(), stdout, why);

	if (r < 0) {
		error_print(program, "%s", why);
		return code_of(r);
	}
	return EXIT_CODE_OK;
}

static enum exit_code run_watch(const struct arguments *a, const struct config *cfg,
				const char *dev_dir)
{
	struct watch_spec spec = { .cfg = cfg, .dev_dir = dev_dir, .platform = platform_posix() };
	char why[WATCH_WHY_BYTES] = "";
	struct watch *watch;
	int r;

	if (a->dump != NULL) {
		spec.dump = fopen(a->dump, "we");
		if (spec.dump == NULL) {
			error_print(program, "--dump: %s: %s", a->dump, strerror(errno));
			return code_of(-errno);
		}
	}
	r = watch_create(&spec, &watch, why);
	if (r < 0) {
		error_print(program, "%s", why);
		return r == -ENOENT ? EXIT_CODE_CONFIG : code_of(r);
	}
	while (!stop_requested()) {
		watch_step(watch);
	}
	watch_finish(watch);
	watch_destroy(watch);
	if (spec.dump != NULL && fclose(spec.dump) != 0) {
		error_print(program, "--dump: %s: %s", a->dump, strerror(errno));
		return EXIT_CODE_FAILED;
	}
	return EXIT_CODE_OK;
}

int main(int argc, char **argv)
{
	static struct config cfg;
	struct arguments a = { .dev_dir = "/dev" };
	const struct args_option options[] = {
		{ "edges", 0, args_text, &a.edges, "FILE",
		  "follow the edge file of ecdaq-sim instead of lines (sync0.edges); results are "
		  "marked \"simulated edges\"" },
		{ "dump", 0, args_text, &a.dump, "FILE",
		  "write every edge and cycle to FILE, for --replay" },
		{ "replay", 0, args_text, &a.replay, "FILE",
		  "analyse recorded edges, print the results and exit" },
		{ "calibrate", 0, args_flag, &a.is_calibrate, NULL,
		  "the same signal is on the first two lines: measure the noise of this board, "
		  "store "
		  "it in sync0.calibration and exit; with --replay, from the first two slaves of "
		  "the "
		  "file" },
		{ "json", 0, args_flag, &a.is_json, NULL, "with --replay: one JSON object a line" },
		{ "dev-dir", 0, args_text, &a.dev_dir, "DIR", NULL }, /* for tests */
	};
	const struct command_line_override overrides[] = { { "sync0.edges", &a.edges } };
	struct command_line line = {
		.program = program,
		.summary =
			"Checks the SYNC0 pulses of the slaves, wired to GPIO lines "
			"(slaves[].sync0_line),\n"
			"against the cycles of ecdaqd. Waits for the master and follows it through "
			"restarts.\n",
		.options = options,
		.option_count = sizeof(options) / sizeof(options[0]),
		.overrides = overrides,
		.override_count = 1,
		.exit_codes = EXIT_CODE_COMMON | EXIT_CODE_BIT(CONFIG) | EXIT_CODE_BIT(PERMISSION) |
			      EXIT_CODE_BIT(BUSY) | EXIT_CODE_BIT(CHECK_FAILED) |
			      EXIT_CODE_BIT(DISABLED),
	};
	enum exit_code code;

	if (command_line_read(&line, argc, argv, &cfg, &code) == COMMAND_LINE_EXIT) {
		return (int)code;
	}
	if (is_conflict(&a)) {
		return EXIT_CODE_USAGE;
	}
	if (!cfg.sync0_enable && a.edges == NULL && a.replay == NULL && !a.is_calibrate) {
		return (int)command_line_disabled(&line, "sync0.enable");
	}
	if (line.is_check) {
		return (int)command_line_valid(&line);
	}
	if (a.replay != NULL) {
		return (int)run_replay(&a, &cfg);
	}
	stop_catch(STOP_REPEAT_IGNORED, NULL);
	choose_core(&cfg);
	return (int)(a.is_calibrate ? run_calibration(&cfg, a.dev_dir)
				    : run_watch(&a, &cfg, a.dev_dir));
}
