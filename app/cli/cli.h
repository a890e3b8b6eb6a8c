/* SPDX-License-Identifier: MIT */
/*
 * What all verbs of ecdaq share: where the run directory is, how a failure is said, the table of
 * verbs. A failure is one line on standard error, "ecdaq: VERB: what: why"; the exit code says of
 * what kind it is.
 */
#ifndef CLI_CLI_H
#define CLI_CLI_H

#include "config/config.h"

/* Part of the interface (doc/reference/cli.md): numbers do not change. */
enum cli_exit {
	CLI_OK = 0,
	CLI_FAILED = 1,     /* what was asked for could not be done */
	CLI_USAGE = 2,      /* the command line cannot be understood */
	CLI_NO_DAEMON = 3,  /* no ecdaqd, or nothing of it to read */
	CLI_REFUSED = 4,    /* ecdaqd or a slave refused the command */
	CLI_PERMISSION = 5, /* a right is missing */
};

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
	enum cli_exit (*run)(struct cli *cli, int argc, char **argv);
};

/** Say "ecdaq: VERB: ..." on standard error, as one printable line. Returns @code. */
enum cli_exit cli_fail(const struct cli *cli, enum cli_exit code, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/** CLI_PERMISSION for EACCES and EPERM, CLI_NO_DAEMON for what is not there, else CLI_FAILED. */
enum cli_exit cli_exit_of(int errno_value);

/**
 * The path of @file (CONFIG_RUN_...) in the run directory, CONFIG_PATH_BYTES long. CLI_OK, or the
 * code of a failure that was said.
 */
enum cli_exit cli_path(struct cli *cli, const char *file, char *ret_path);

/* The verbs, one file each. */
enum cli_exit verb_channels(struct cli *cli, int argc, char **argv);
enum cli_exit verb_clear(struct cli *cli, int argc, char **argv);
enum cli_exit verb_doctor(struct cli *cli, int argc, char **argv);
enum cli_exit verb_events(struct cli *cli, int argc, char **argv);
enum cli_exit verb_histogram(struct cli *cli, int argc, char **argv);
enum cli_exit verb_log(struct cli *cli, int argc, char **argv);
enum cli_exit verb_oneshot(struct cli *cli, int argc, char **argv);
enum cli_exit verb_sdo(struct cli *cli, int argc, char **argv);
enum cli_exit verb_security(struct cli *cli, int argc, char **argv);
enum cli_exit verb_set(struct cli *cli, int argc, char **argv);
enum cli_exit verb_slaves(struct cli *cli, int argc, char **argv);
enum cli_exit verb_status(struct cli *cli, int argc, char **argv);
enum cli_exit verb_stop(struct cli *cli, int argc, char **argv);
enum cli_exit verb_sync0(struct cli *cli, int argc, char **argv);
enum cli_exit verb_top(struct cli *cli, int argc, char **argv);
enum cli_exit verb_watch(struct cli *cli, int argc, char **argv);

#endif
