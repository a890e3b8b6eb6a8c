/* SPDX-License-Identifier: MIT */
/* ecdaq-record: follows the sample ring of ecdaqd and records it, until it is stopped. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/stop.h"
#include "config/config.h"
#include "program/command_line.h"
#include "program/error.h"
#include "record/recorder.h"

enum { IDLE_NS = 5000000, CONFIG_TEXT_BYTES = 1 << 20, ERROR_BYTES = 512 };

static const char program[] = "ecdaq-record";

struct recording {
	struct config cfg;
	char ring_path[CONFIG_PATH_BYTES];
	char events_path[CONFIG_PATH_BYTES];
	char sync0_path[CONFIG_PATH_BYTES];
	char sync0_events_path[CONFIG_PATH_BYTES];
	char status_path[CONFIG_PATH_BYTES];
	char *config_text;
};

/* The file as it is, for the recordings. */
static char *read_text(const char *path)
{
	char *text = calloc(1, CONFIG_TEXT_BYTES + 1);
	FILE *in = text != NULL && path[0] != '\0' ? fopen(path, "re") : NULL;

	if (in != NULL) {
		size_t n = fread(text, 1, CONFIG_TEXT_BYTES, in);

		text[n] = '\0';
		fclose(in);
	}
	return text;
}

static int find_paths(struct recording *pg)
{
	int r = config_run_path(&pg->cfg, CONFIG_RUN_SAMPLES, pg->ring_path, sizeof(pg->ring_path));

	r = r < 0 ? r
		  : config_run_path(&pg->cfg, CONFIG_RUN_EVENTS, pg->events_path,
				    sizeof(pg->events_path));
	r = r < 0 ? r
		  : config_run_path(&pg->cfg, CONFIG_RUN_RECORD_STATUS, pg->status_path,
				    sizeof(pg->status_path));
	r = r < 0 ? r
		  : config_run_path(&pg->cfg, CONFIG_RUN_SYNC0, pg->sync0_path,
				    sizeof(pg->sync0_path));
	r = r < 0 ? r
		  : config_run_path(&pg->cfg, CONFIG_RUN_SYNC0_EVENTS, pg->sync0_events_path,
				    sizeof(pg->sync0_events_path));
	if (r < 0) {
		error_print(program, "run directory: %s", strerror(-r));
	}
	return r;
}

static void report(void *ctx, const char *line)
{
	(void)ctx;
	error_print(program, "%s", line);
}

static struct recorder_options recorder_options(const struct recording *pg)
{
	const struct config *cfg = &pg->cfg;

	return (struct recorder_options){
		.ring_path = pg->ring_path,
		.events_path = pg->events_path,
		.status_path = pg->status_path,
		.sync0_path = pg->sync0_path,
		.sync0_events_path = pg->sync0_events_path,
		.dir = cfg->record_dir,
		.pid = getpid(),
		.chunk_period_ns = cfg->record_chunk_period_ns,
		.sync_period_ns = cfg->record_sync_period_ns,
		.rotate_period_ns = cfg->record_rotate_period_ns,
		.rotate_bytes = cfg->record_rotate_bytes,
		.budget_bytes = cfg->record_budget_bytes,
		.reserve_bytes = cfg->record_reserve_bytes,
		.when_full = cfg->record_when_full,
		.marks_dir = cfg->uplink_enable ? cfg->uplink_dir : "",
		.keep_until_uploaded = cfg->record_keep_until_uploaded,
		.values = cfg->record_values,
		.zstd_level = cfg->record_compression,
		.config_path = cfg->path,
		.config_text = pg->config_text,
		.platform = platform_posix(),
		.report = report,
	};
}

static int run(struct recorder *rec, int is_once)
{
	int ring_error = 0;
	int r;

	stop_catch(STOP_REPEAT_IGNORED, NULL);
	stop_block();
	while (!stop_requested()) {
		enum recorder_result result = recorder_step(rec);

		ring_error = is_once ? recorder_ring_error(rec) : 0;
		if ((result == RECORDER_ENDED && is_once) || ring_error < 0) {
			break;
		}
		stop_wait(result == RECORDER_IDLE ? IDLE_NS : 0);
	}
	r = recorder_finish(rec);
	if (r < 0) {
		error_print(program, "ended without recording all: %s", strerror(-r));
	}
	return r < 0 ? r : ring_error; /* which was told when it was found */
}

static enum exit_code code_of(int error)
{
	return error == -EBUSY                                          ? EXIT_CODE_BUSY
	       : error == -EACCES || error == -EPERM || error == -EROFS ? EXIT_CODE_PERMISSION
									: EXIT_CODE_FAILED;
}

static enum exit_code record(struct recording *pg, int is_once)
{
	struct recorder_options options;
	struct recorder *rec;
	char error[ERROR_BYTES];
	int r;

	pg->config_text = read_text(pg->cfg.path);
	if (pg->config_text == NULL) {
		error_print(program, "%s", strerror(ENOMEM));
		return EXIT_CODE_FAILED;
	}
	options = recorder_options(pg);
	r = recorder_create(&options, &rec, error, sizeof(error));
	if (r < 0) {
		error_print(program, "%s", error);
		free(pg->config_text);
		return code_of(r);
	}
	r = run(rec, is_once);
	recorder_destroy(rec);
	free(pg->config_text);
	return r < 0 ? code_of(r) : EXIT_CODE_OK;
}

int main(int argc, char **argv)
{
	static struct recording pg;
	const char *dir = NULL;
	int is_once = 0;
	const struct args_option options[] = {
		{ "dir", 0, args_text, &dir, "DIR", "directory of the recordings (record.dir)" },
		{ "once", 0, args_flag, &is_once, NULL, "exit when the master has ended" },
	};
	const struct command_line_override overrides[] = { { "record.dir", &dir } };
	struct command_line line = {
		.program = program,
		.summary =
			"Records every cycle of ecdaqd to MCAP files. Waits for the master, "
			"follows it "
			"through\n"
			"restarts, and continues after the last recorded cycle when it was killed "
			"itself.\n",
		.options = options,
		.option_count = 2,
		.overrides = overrides,
		.override_count = 1,
		.exit_codes = EXIT_CODE_COMMON | EXIT_CODE_BIT(CONFIG) | EXIT_CODE_BIT(PERMISSION) |
			      EXIT_CODE_BIT(BUSY) | EXIT_CODE_BIT(DISABLED),
	};
	enum exit_code code;

	if (command_line_read(&line, argc, argv, &pg.cfg, &code) == COMMAND_LINE_EXIT) {
		return (int)code;
	}
	if (find_paths(&pg) < 0) {
		return EXIT_CODE_CONFIG;
	}
	if (!pg.cfg.record_enable) {
		return (int)command_line_disabled(&line, "record.enable");
	}
	return (int)(line.is_check ? command_line_valid(&line) : record(&pg, is_once));
}
