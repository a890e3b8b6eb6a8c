/* SPDX-License-Identifier: MIT */
/*
 * What all verbs of ecdaq share: their command line, the run directory, how an error is reported,
 * the table of verbs. An error is one line on standard error, "ecdaq: VERB: object: problem".
 */
#ifndef CLI_CLI_H
#define CLI_CLI_H

#include "base/args.h"
#include "config/config.h"
#include "program/exit_code.h"

struct verb;
struct selection;

struct cli {
	const struct verb *verb;
	const char *run_dir;  /* --run-dir; NULL: by configuration and environment */
	const char *config;   /* --config; NULL: none */
	const char *position; /* --position, --alias; NULL: none */
	const char *alias;
	struct selection *selection; /* of these, for select() */
	/** Put the selected slaves into the operands of @args: the code of a failure, reported. */
	enum exit_code (*select)(struct cli *cli, struct args *args);
	const struct verb *verbs; /* all of them */
	size_t verb_count;
	/** In place of the text of --help; NULL: none. */
	void (*show_help)(const struct verb *verb, const struct args *args);
	int is_dir_chosen;           /* by option, configuration or environment */
	char dir[CONFIG_PATH_BYTES]; /* the run directory, with a slash behind it, once it was asked
					for */
};

struct verb {
	const char *name;
	const char *operands; /* "CHANNEL..."; with SLAVE it has --position and --alias, too */
	const char *summary;  /* one line */
	const char *detail;   /* more lines for --help; NULL */
	enum exit_code (*run)(struct cli *cli, int argc, char **argv);
};

/** Report "ecdaq: VERB: ..." on standard error, as one printable line. Returns @code. */
enum exit_code cli_fail(const struct cli *cli, enum exit_code code, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/**
 * Sort the words behind the verb by @args and the global options. 1; 0 when --help or --version was
 * answered or an error reported, with the exit code in @ret_code.
 */
int cli_parse(struct cli *cli, struct args *args, int argc, char **argv, enum exit_code *ret_code);

/** Which operand of @verb is SLAVE, from 1 on; 0: none. *@ret_is_list: any number, the last ones.
 */
int cli_slave_at(const struct verb *verb, int *ret_is_list);

/** --position and --alias, with their texts but without targets, if @verb has SLAVE. */
const struct args_option *cli_selecting(const struct verb *verb, size_t *ret_count);

/** args_parse() with the global options, which go to @cli. */
enum args_result cli_take(struct cli *cli, struct args *args, int argc, char **argv, char *error);

/** EXIT_CODE_PERMISSION for EACCES and EPERM, EXIT_CODE_NO_DAEMON for what is not there, else
 * EXIT_CODE_FAILED. */
enum exit_code cli_exit_of(int errno_value);
/** Report that this user may not @what ("read", "use") @path: EXIT_CODE_PERMISSION. */
enum exit_code cli_fail_permission(const struct cli *cli, const char *what, const char *path);

/**
 * The path of @file (CONFIG_RUN_...) in the run directory, CONFIG_PATH_BYTES long. EXIT_CODE_OK, or
 * the code of a failure, which has been reported.
 */
enum exit_code cli_path(struct cli *cli, const char *file, char *ret_path);

/* The exit codes of all verbs, for exit_code_help(). */
#define CLI_EXIT_CODES                                                                             \
	(EXIT_CODE_COMMON | EXIT_CODE_BIT(CONFIG) | EXIT_CODE_BIT(NO_SLAVE) |                      \
	 EXIT_CODE_BIT(SLAVES) | EXIT_CODE_BIT(STATE) | EXIT_CODE_BIT(PERMISSION) |                \
	 EXIT_CODE_BIT(NO_DAEMON) | EXIT_CODE_BIT(REFUSED))

/* The verbs, one file each. */
enum exit_code verb_aoe(struct cli *cli, int argc, char **argv);
enum exit_code verb_channels(struct cli *cli, int argc, char **argv);
enum exit_code verb_clear(struct cli *cli, int argc, char **argv);
enum exit_code verb_completion(struct cli *cli, int argc, char **argv);
enum exit_code verb_config(struct cli *cli, int argc, char **argv);
enum exit_code verb_crc(struct cli *cli, int argc, char **argv);
enum exit_code verb_cstruct(struct cli *cli, int argc, char **argv);
enum exit_code verb_data(struct cli *cli, int argc, char **argv);
enum exit_code verb_doctor(struct cli *cli, int argc, char **argv);
enum exit_code verb_domains(struct cli *cli, int argc, char **argv);
enum exit_code verb_eni(struct cli *cli, int argc, char **argv);
enum exit_code verb_eoe(struct cli *cli, int argc, char **argv);
enum exit_code verb_esi(struct cli *cli, int argc, char **argv);
enum exit_code verb_events(struct cli *cli, int argc, char **argv);
enum exit_code verb_firmware(struct cli *cli, int argc, char **argv);
enum exit_code verb_foe(struct cli *cli, int argc, char **argv);
enum exit_code verb_histogram(struct cli *cli, int argc, char **argv);
enum exit_code verb_manual(struct cli *cli, int argc, char **argv);
enum exit_code verb_metrics(struct cli *cli, int argc, char **argv);
enum exit_code verb_oneshot(struct cli *cli, int argc, char **argv);
enum exit_code verb_pdo(struct cli *cli, int argc, char **argv);
enum exit_code verb_pcap(struct cli *cli, int argc, char **argv);
enum exit_code verb_reg(struct cli *cli, int argc, char **argv);
enum exit_code verb_rescan(struct cli *cli, int argc, char **argv);
enum exit_code verb_scan(struct cli *cli, int argc, char **argv);
enum exit_code verb_sdo(struct cli *cli, int argc, char **argv);
enum exit_code verb_set(struct cli *cli, int argc, char **argv);
enum exit_code verb_sii(struct cli *cli, int argc, char **argv);
enum exit_code verb_slaves(struct cli *cli, int argc, char **argv);
enum exit_code verb_soe(struct cli *cli, int argc, char **argv);
enum exit_code verb_state(struct cli *cli, int argc, char **argv);
enum exit_code verb_status(struct cli *cli, int argc, char **argv);
enum exit_code verb_stop(struct cli *cli, int argc, char **argv);
enum exit_code verb_sync0(struct cli *cli, int argc, char **argv);
enum exit_code verb_top(struct cli *cli, int argc, char **argv);
enum exit_code verb_topology(struct cli *cli, int argc, char **argv);
enum exit_code verb_voe(struct cli *cli, int argc, char **argv);
enum exit_code verb_watch(struct cli *cli, int argc, char **argv);
enum exit_code verb_web_token(struct cli *cli, int argc, char **argv);
enum exit_code verb_xml(struct cli *cli, int argc, char **argv);

#endif
