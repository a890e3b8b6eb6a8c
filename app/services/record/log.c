/* SPDX-License-Identifier: MIT */
/* The command line of `ecdaq log`. */
#include "record/log.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <unistd.h>

#include "base/args.h"
#include "config/config.h"
#include "program/error.h"
#include "program/progress.h"
#include "record/log_common.h"
#include "record/messages.h"

struct arguments {
	const char *dir;
	const char *config_path;
	const char *run_dir; /* a global option of ecdaq: accepted, not used */
	const char *output;
	struct log_export_options export;
	uint64_t session;
	uint64_t rows;
	int is_json;
	int is_progress;
};

/* Options that a command takes. */
enum {
	TAKES_ALL = 0,
	TAKES_DIR = 1 << 0,
	TAKES_OUTPUT = 1 << 1,
	TAKES_CHANNELS = 1 << 2,
	TAKES_RAW = 1 << 3,
	TAKES_ROWS = 1 << 4,
	TAKES_SESSION = 1 << 5,
	TAKES_RANGE = 1 << 6,
};

enum { OPTIONS = 12 };

static const char program[] = "ecdaq: log";

static void help(FILE *out)
{
	fputs("usage: ecdaq log list [--dir DIR] [--json]\n"
	      "       ecdaq log info FILE [--json]\n"
	      "       ecdaq log check [--dir DIR | FILE-OR-DIR...] [--json]\n"
	      "       ecdaq log recover FILE [--output FILE] [--json]\n"
	      "       ecdaq log export [--dir DIR | FILE-OR-DIR...] [--channels NAME,...] [--from "
	      "CYCLE]\n"
	      "                        [--to CYCLE] [--raw] [--output FILE] [--json]\n"
	      "       ecdaq log cut [--dir DIR] [--session NUMBER] [--from CYCLE] [--to CYCLE]\n"
	      "                        [--output FILE]\n"
	      "       ecdaq log envelope [--dir DIR] [--session NUMBER] [--channels NAME,...]\n"
	      "                        [--from CYCLE] [--to CYCLE] [--rows N] [--json]\n"
	      "       ecdaq log ros2pkg FILE... [--output DIR]\n"
	      "\n"
	      "  list     the recordings: start, duration, cycles, size, state\n"
	      "  info     topics with their fields, counts, metadata of one recording\n"
	      "  check    read all: checksums, copies of definitions, cycle numbers without a gap "
	      "in "
	      "and\n"
	      "           between files\n"
	      "  recover  repair an incomplete recording; --output copies what is intact\n"
	      "  export   a table with one row per cycle, as CSV (pandas.read_csv reads it); "
	      "columns as\n"
	      "           NAME [UNIT]\n"
	      "  cut      the cycles from --from to --to of a session, with their events, as a "
	      "recording\n"
	      "  envelope least, greatest, mean and RMS value of each channel in each of N parts "
	      "of a\n"
	      "           session: a day in a moment\n"
	      "  ros2pkg  the ROS 2 package with the recording's message types, for ros2 bag "
	      "play\n"
	      "\n"
	      "  --dir DIR        the recordings' directory (default: record.dir)\n"
	      "  --config FILE    ecdaq.yaml, for record.dir\n"
	      "  --channels LIST  only these, as `ecdaq channels` names them\n"
	      "  --from, --to     first and last cycle\n"
	      "  --session NUMBER of the recordings (ecdaq log info; default: the newest one)\n"
	      "  --rows N         parts, 1 to 65536 (default: 1000)\n"
	      "  --raw            raw values (default: physical)\n"
	      "  --output FILE    file to write (export, cut: default is standard output; "
	      "ros2pkg:\n"
	      "                   the new folder, default " MESSAGES_PACKAGE ")\n"
	      "  --json           JSON (export: one object per line)\n"
	      "  --progress       check, export, recover: progress also where standard error is "
	      "no\n"
	      "                   terminal\n"
	      "\n",
	      out);
	exit_code_help(out, EXIT_CODE_COMMON | EXIT_CODE_BIT(CONFIG));
	fputs("check: 1 for gaps or damage.\n", out);
}

static int usage(const char *message)
{
	error_print(program, "%s (see ecdaq log --help)", message);
	return EXIT_CODE_USAGE;
}

/* The options that @takes allows, into @ret_options. Their number. */
static size_t select_options(unsigned takes, struct arguments *a, struct args_option *ret_options)
{
	const struct {
		unsigned need;
		struct args_option option;
	} rows[OPTIONS] = {
		{ TAKES_ALL, { "config", 0, args_text, &a->config_path, "FILE", NULL } },
		{ TAKES_ALL, { "run-dir", 0, args_text, &a->run_dir, "DIR", NULL } },
		{ TAKES_ALL, { "json", 0, args_flag, &a->is_json, NULL, NULL } },
		{ TAKES_ALL, { "progress", 0, args_flag, &a->is_progress, NULL, NULL } },
		{ TAKES_DIR, { "dir", 0, args_text, &a->dir, "DIR", NULL } },
		{ TAKES_OUTPUT, { "output", 0, args_text, &a->output, "FILE", NULL } },
		{ TAKES_CHANNELS, { "channels", 0, args_text, &a->export.channels, "LIST", NULL } },
		{ TAKES_RANGE, { "from", 0, args_cycle, &a->export.from, "CYCLE", NULL } },
		{ TAKES_RANGE, { "to", 0, args_cycle, &a->export.to, "CYCLE", NULL } },
		{ TAKES_RAW, { "raw", 0, args_flag, &a->export.is_raw, NULL, NULL } },
		{ TAKES_SESSION, { "session", 0, args_cycle, &a->session, "NUMBER", NULL } },
		{ TAKES_ROWS, { "rows", 0, args_cycle, &a->rows, "N", NULL } },
	};
	size_t count = 0;

	for (size_t i = 0; i < OPTIONS; i++) {
		if ((rows[i].need & ~takes) == 0) {
			ret_options[count++] = rows[i].option;
		}
	}
	return count;
}

/* 1 with @args filled; 0 with the exit code in @ret_code. */
static int parse(struct args *args, int argc, char **argv, int *ret_code)
{
	char error[ARGS_ERROR_BYTES];

	*ret_code = EXIT_CODE_OK;
	switch (args_parse(args, argc, argv, error)) {
	case ARGS_OK:
		return 1;
	case ARGS_HELP:
		help(stdout);
		return 0;
	case ARGS_VERSION:
		puts("ecdaq-log " ECDAQ_VERSION);
		return 0;
	case ARGS_ERROR:
		*ret_code = usage(error);
		return 0;
	}
	return 0;
}

/* The directory of --dir, or record.dir. */
static int find_dir(const struct arguments *a, char *dir, size_t dir_bytes)
{
	static struct config cfg;
	char error[512];

	config_defaults(&cfg);
	if (a->dir == NULL && a->config_path != NULL &&
	    config_load(a->config_path, &cfg, error, sizeof(error)) < 0) {
		error_print(program, "--config: %s", error);
		return EXIT_CODE_CONFIG;
	}
	snprintf(dir, dir_bytes, "%s", a->dir != NULL ? a->dir : cfg.record_dir);
	return EXIT_CODE_OK;
}

static enum log_format format_of(const struct arguments *a)
{
	return a->is_json ? LOG_JSON : LOG_TEXT;
}

static int run_list(const struct arguments *a, char **operands, int count)
{
	char dir[PATH_MAX];
	int r = find_dir(a, dir, sizeof(dir));

	(void)operands;
	(void)count;
	return r != EXIT_CODE_OK ? r : log_list(dir, format_of(a), stdout, stderr);
}

static int run_info(const struct arguments *a, char **operands, int count)
{
	(void)count;
	return log_info(operands[0], format_of(a), stdout, stderr);
}

static int run_check(const struct arguments *a, char **operands, int count)
{
	char dir[PATH_MAX];
	const char *paths[1] = { dir };
	int r;

	if (count > 0) {
		return log_check((const char *const *)operands, (size_t)count, format_of(a), stdout,
				 stderr);
	}
	r = find_dir(a, dir, sizeof(dir));
	return r != EXIT_CODE_OK ? r : log_check(paths, 1, format_of(a), stdout, stderr);
}

static int run_recover(const struct arguments *a, char **operands, int count)
{
	(void)count;
	return log_recover(operands[0], a->output, format_of(a), stdout, stderr);
}

static int run_export(const struct arguments *a, char **operands, int count)
{
	struct log_export_options options = a->export;
	char dir[PATH_MAX];
	const char *paths[1] = { dir };
	FILE *out = stdout;
	int r = count > 0 ? EXIT_CODE_OK : find_dir(a, dir, sizeof(dir));

	if (r != EXIT_CODE_OK) {
		return r;
	}
	options.paths = count > 0 ? (const char *const *)operands : paths;
	options.path_count = count > 0 ? (size_t)count : 1;
	options.format = format_of(a);
	options.output = a->output;
	if (a->output != NULL) {
		out = fopen(a->output, "we");
		if (out == NULL) {
			return log_fail(stderr, a->output, strerror(errno));
		}
	}
	r = log_export(&options, out, stderr);
	if (out != stdout && fclose(out) != 0 && r == EXIT_CODE_OK) {
		r = log_fail(stderr, a->output, strerror(errno));
	}
	return r;
}

static int run_envelope(const struct arguments *a, char **operands, int count)
{
	char dir[PATH_MAX];
	const struct log_envelope_options options = { .dir = dir,
						      .channels = a->export.channels,
						      .session = a->session,
						      .from = a->export.from,
						      .to = a->export.to,
						      .rows = a->rows,
						      .format = format_of(a) };
	int r;

	(void)operands;
	(void)count;
	if (a->rows < 1 || a->rows > LOG_ENVELOPE_ROWS) {
		return usage("--rows: is not 1 to 65536");
	}
	r = find_dir(a, dir, sizeof(dir));
	return r != EXIT_CODE_OK ? r : log_envelope(&options, stdout, stderr);
}

static int run_cut(const struct arguments *a, char **operands, int count)
{
	char dir[PATH_MAX];
	const struct log_cut_options options = { .dir = dir,
						 .output = a->output,
						 .session = a->session,
						 .from = a->export.from,
						 .to = a->export.to };
	int r;

	(void)operands;
	(void)count;
	if (a->output == NULL && isatty(STDOUT_FILENO)) {
		return usage("cut: standard output is a terminal: use --output FILE");
	}
	r = find_dir(a, dir, sizeof(dir));
	return r != EXIT_CODE_OK ? r : log_cut(&options, stderr);
}

static int run_ros2pkg(const struct arguments *a, char **operands, int count)
{
	return log_ros2pkg((const char *const *)operands, (size_t)count,
			   a->output != NULL ? a->output : MESSAGES_PACKAGE, stdout, stderr);
}

static const struct command {
	const char *name;
	unsigned takes;
	int operands_min;
	int operands_max;
	const char *operands;
	int (*run)(const struct arguments *a, char **operands, int count);
} commands[] = {
	{ "list", TAKES_DIR, 0, 0, "", run_list },
	{ "info", 0, 1, 1, "FILE", run_info },
	{ "check", TAKES_DIR, 0, INT_MAX, "", run_check },
	{ "recover", TAKES_OUTPUT, 1, 1, "FILE", run_recover },
	{ "export", TAKES_DIR | TAKES_OUTPUT | TAKES_CHANNELS | TAKES_RANGE | TAKES_RAW, 0, INT_MAX,
	  "", run_export },
	{ "cut", TAKES_DIR | TAKES_OUTPUT | TAKES_SESSION | TAKES_RANGE, 0, 0, "", run_cut },
	{ "envelope", TAKES_DIR | TAKES_CHANNELS | TAKES_SESSION | TAKES_RANGE | TAKES_ROWS, 0, 0,
	  "", run_envelope },
	{ "ros2pkg", TAKES_OUTPUT, 1, INT_MAX, "FILE", run_ros2pkg },
};

static int run_command(const struct command *command, struct arguments *a, const struct args *words)
{
	struct args_option options[OPTIONS];
	struct args args = { .options = options,
			     .option_count = select_options(command->takes, a, options),
			     .operands_min = command->operands_min,
			     .operands_max = command->operands_max,
			     .operands_usage = command->operands };
	int code;

	if (!parse(&args, words->operand_count - 1, words->operands + 1, &code)) {
		return code;
	}
	if (a->export.from > a->export.to) {
		return usage("--from: is after --to");
	}
	if (a->is_progress) {
		progress_always();
	}
	return command->run(a, args.operands, args.operand_count);
}

int log_main(int argc, char **argv)
{
	struct arguments a = { .export = { .to = UINT64_MAX }, .rows = 1000 };
	struct args_option options[OPTIONS];
	struct args args = {
		.options = options,
		.option_count = select_options(TAKES_ALL, &a, options),
		.operands_min = 1,
		.operands_usage =
			"command: list, info, check, recover, export, cut, envelope or ros2pkg",
		.ends_at_operand = 1
	};
	char error[ARGS_ERROR_BYTES];
	int code;

	if (!parse(&args, argc - 1, argv + 1, &code)) {
		return code;
	}
	for (size_t i = 0; i < sizeof(commands) / sizeof(commands[0]); i++) {
		if (strcmp(commands[i].name, args.operands[0]) == 0) {
			return run_command(&commands[i], &a, &args);
		}
	}
	snprintf(error, sizeof(error), "%.200s: unknown command", args.operands[0]);
	return usage(error);
}
