/* SPDX-License-Identifier: MIT */
#include "cli/cli.h"

#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "cli/running.h"
#include "program/error.h"

enum { RUNNING_LISTED = 32 };

enum exit_code cli_fail(const struct cli *cli, enum exit_code code, const char *format, ...)
{
	char prefix[64];
	va_list args;

	snprintf(prefix, sizeof(prefix), "ecdaq%s%s", cli->verb == NULL ? "" : ": ",
		 cli->verb == NULL ? "" : cli->verb->name);
	va_start(args, format);
	error_vprint(prefix, format, args);
	va_end(args);
	return code;
}

/* Only for --help; cli_take() has the same with their targets. */
static const struct args_option selecting[] = {
	{ "position", 'p', args_text, NULL, "LIST",
	  "slaves by position, in place of SLAVE: 0,2-4" },
	{ "alias", 'a', args_text, NULL, "LIST",
	  "slaves by alias; with --position those so many behind it" },
};

enum { SELECTING_COUNT = sizeof(selecting) / sizeof(selecting[0]) };

int cli_slave_at(const struct verb *verb, int *ret_is_list)
{
	const char *slave = strstr(verb->operands, "SLAVE");
	int at = 1;

	if (slave == NULL) {
		return 0;
	}
	for (const char *p = verb->operands; p < slave; p++) {
		at += *p == ' ';
	}
	*ret_is_list = strncmp(slave, "SLAVE...", strlen("SLAVE...")) == 0;
	return at;
}

const struct args_option *cli_selecting(const struct verb *verb, size_t *ret_count)
{
	int is_list;

	*ret_count = cli_slave_at(verb, &is_list) > 0 ? SELECTING_COUNT : 0;
	return selecting;
}

static void help(const struct verb *verb, const struct args *args)
{
	const struct args_option *extra;
	size_t count;

	printf("usage: ecdaq %s%s%s%s\n\n%s\n", verb->name,
	       args->option_count > 0 ? " [OPTION...]" : "", verb->operands[0] == '\0' ? "" : " ",
	       verb->operands, verb->summary);
	if (verb->detail != NULL) {
		printf("\n%s", verb->detail);
	}
	if (args->option_count > 0) {
		putchar('\n');
	}
	args_help(stdout, args->options, args->option_count);
	extra = cli_selecting(verb, &count);
	args_help(stdout, extra, count);
}

enum args_result cli_take(struct cli *cli, struct args *args, int argc, char **argv, char *error)
{
	const struct args_option globals[] = {
		{ "run-dir", 0, args_text, &cli->run_dir, "DIR", NULL },
		{ "config", 0, args_text, &cli->config, "FILE", NULL },
		{ "position", 'p', args_text, &cli->position, "LIST", NULL },
		{ "alias", 'a', args_text, &cli->alias, "LIST", NULL },
	};
	int is_list;
	int has_slaves = cli->verb != NULL && cli_slave_at(cli->verb, &is_list) > 0;
	enum args_result result;

	args->shared = globals;
	args->shared_count =
		sizeof(globals) / sizeof(globals[0]) - (has_slaves ? 0 : SELECTING_COUNT);
	args->checks_later = cli->verb != NULL;
	result = args_parse(args, argc, argv, error);
	args->shared_count = 0;
	return result;
}

int cli_parse(struct cli *cli, struct args *args, int argc, char **argv, enum exit_code *ret_code)
{
	char error[ARGS_ERROR_BYTES];
	enum args_result r;

	*ret_code = EXIT_CODE_OK;
	args->operands_usage = cli->verb->operands;
	r = cli_take(cli, args, argc, argv, error);
	if (r == ARGS_OK && (cli->position != NULL || cli->alias != NULL)) {
		*ret_code = cli->select(cli, args);
		if (*ret_code != EXIT_CODE_OK) {
			return 0;
		}
	}
	if (r == ARGS_OK) {
		r = args_check_operands(args, error);
	}
	switch (r) {
	case ARGS_OK:
		return 1;
	case ARGS_HELP:
		(cli->show_help != NULL ? cli->show_help : help)(cli->verb, args);
		return 0;
	case ARGS_VERSION:
		puts("ecdaq " ECDAQ_VERSION);
		return 0;
	case ARGS_ERROR:
		*ret_code = cli_fail(cli, EXIT_CODE_USAGE, "%s (see ecdaq %s --help)", error,
				     cli->verb->name);
		return 0;
	}
	return 0;
}

enum exit_code cli_exit_of(int errno_value)
{
	switch (errno_value) {
	case EACCES:
	case EPERM:
		return EXIT_CODE_PERMISSION;
	case ENOENT:
	case ENOTDIR:
	case ECONNREFUSED:
		return EXIT_CODE_NO_DAEMON;
	default:
		return EXIT_CODE_FAILED;
	}
}

enum exit_code cli_fail_permission(const struct cli *cli, const char *what, const char *path)
{
	return cli_fail(cli, EXIT_CODE_PERMISSION,
			"no permission to %s %s: be root or in its group", what, path);
}

/* None is running: the last state of the system's ecdaqd where this user has none. */
static void prefer_the_system(char *dir)
{
	static const char system_dir[] = "/run/ecdaq/";
	char page[CONFIG_PATH_BYTES];

	snprintf(page, sizeof(page), "%.200s%s", dir, CONFIG_RUN_STATUS);
	if (access(page, F_OK) < 0 && access(system_dir, F_OK) == 0) {
		memcpy(dir, system_dir, sizeof(system_dir));
	}
}

/* No directory was named: that of the one ecdaqd that is running. */
static enum exit_code find_running(struct cli *cli)
{
	struct running found[RUNNING_LISTED];
	size_t count = running_find("/run/ecdaq", "/dev/shm", found, RUNNING_LISTED);

	if (count == 0) {
		prefer_the_system(cli->dir);
		return EXIT_CODE_OK;
	}
	if (count == 1) {
		memcpy(cli->dir, found[0].dir, sizeof(cli->dir));
		return EXIT_CODE_OK;
	}
	cli_fail(cli, EXIT_CODE_NO_DAEMON, "several ecdaqd are running: select one:");
	for (size_t i = 0; i < count; i++) {
		fprintf(stderr, "  --run-dir %.*s  (%s%s, pid %" PRId64 ")\n",
			(int)strlen(found[i].dir) - 1, found[i].dir,
			found[i].is_simulated ? "simulated, " : "", found[i].interface,
			found[i].pid);
	}
	return EXIT_CODE_NO_DAEMON;
}

static enum exit_code find_dir(struct cli *cli)
{
	struct config cfg;
	char error[512];

	config_defaults(&cfg);
	if (cli->config != NULL && config_load(cli->config, &cfg, error, sizeof(error)) < 0) {
		return cli_fail(cli, EXIT_CODE_CONFIG, "--config: %s", error);
	}
	if (cli->run_dir != NULL) {
		if (snprintf(cfg.run_dir, sizeof(cfg.run_dir), "%s", cli->run_dir) >=
		    (int)sizeof(cfg.run_dir)) {
			return cli_fail(cli, EXIT_CODE_USAGE, "--run-dir: the path is too long");
		}
	}
	if (config_run_path(&cfg, "", cli->dir, sizeof(cli->dir)) < 0) {
		return cli_fail(cli, EXIT_CODE_USAGE, "run directory: the path is too long");
	}
	cli->is_dir_chosen = config_has_run_dir(&cfg);
	return cli->is_dir_chosen ? EXIT_CODE_OK : find_running(cli);
}

enum exit_code cli_path(struct cli *cli, const char *file, char *ret_path)
{
	char path[2 * CONFIG_PATH_BYTES];
	enum exit_code result;

	if (cli->dir[0] == '\0') {
		result = find_dir(cli);
		if (result != EXIT_CODE_OK) {
			cli->dir[0] = '\0';
			return result;
		}
	}
	snprintf(path, sizeof(path), "%s%s", cli->dir, file);
	if (strlen(path) >= CONFIG_PATH_BYTES) {
		return cli_fail(cli, EXIT_CODE_USAGE, "run directory: the path is too long");
	}
	memcpy(ret_path, path, strlen(path) + 1);
	return EXIT_CODE_OK;
}
