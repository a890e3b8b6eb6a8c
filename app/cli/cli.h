/* SPDX-License-Identifier: MIT */
/*
 * What all verbs of ecdaq share: where the run directory is, how a failure is said, the table of
 * verbs. A failure is one line on standard error, "ecdaq: VERB: what: why"; the exit code says of
 * what kind it is.
 */
#ifndef CLI_CLI_H
#define CLI_CLI_H

#include "config/config.h"
#include "program/exit_code.h"

struct verb;

struct cli {
	const struct verb *verb;
	const char *run_dir;         /* --run-dir; NULL: by configuration and environment */
	const char *config;          /* --config; NULL: none */
	char dir[CONFIG_PATH_BYTES]; /* the run directory, with a slash behind it, once it was asked
					for */
};

struct verb {
	const char *name;
	const char *operands; /* "CHANNEL..." */
	const char *summary;  /* one line */
	const char *detail;   /* more lines for --help; NULL */
	enum exit_code (*run)(struct cli *cli, int argc, char **argv);
};

/** Say "ecdaq: VERB: ..." on standard error, as one printable line. Returns @code. */
enum exit_code cli_fail(const struct cli *cli, enum exit_code code, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/** EXIT_CODE_PERMISSION for EACCES and EPERM, EXIT_CODE_NO_DAEMON for what is not there, else
 * EXIT_CODE_FAILED. */
enum exit_code cli_exit_of(int errno_value);

/**
 * The path of @file (CONFIG_RUN_...) in the run directory, CONFIG_PATH_BYTES long. EXIT_CODE_OK, or
 * the code of a failure that was said.
 */
enum exit_code cli_path(struct cli *cli, const char *file, char *ret_path);

/* The verbs, one file each. */
enum exit_code verb_channels(struct cli *cli, int argc, char **argv);
enum exit_code verb_clear(struct cli *cli, int argc, char **argv);
enum exit_code verb_doctor(struct cli *cli, int argc, char **argv);
enum exit_code verb_events(struct cli *cli, int argc, char **argv);
enum exit_code verb_histogram(struct cli *cli, int argc, char **argv);
enum exit_code verb_log(struct cli *cli, int argc, char **argv);
enum exit_code verb_oneshot(struct cli *cli, int argc, char **argv);
enum exit_code verb_sdo(struct cli *cli, int argc, char **argv);
enum exit_code verb_security(struct cli *cli, int argc, char **argv);
enum exit_code verb_set(struct cli *cli, int argc, char **argv);
enum exit_code verb_slaves(struct cli *cli, int argc, char **argv);
enum exit_code verb_status(struct cli *cli, int argc, char **argv);
enum exit_code verb_stop(struct cli *cli, int argc, char **argv);
enum exit_code verb_sync0(struct cli *cli, int argc, char **argv);
enum exit_code verb_top(struct cli *cli, int argc, char **argv);
enum exit_code verb_watch(struct cli *cli, int argc, char **argv);

#endif
