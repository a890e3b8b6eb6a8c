/* SPDX-License-Identifier: MIT */
/*
 * Command lines by table: --name, --name=VALUE, --name VALUE, -n, and "--" behind which nothing is
 * an option. The global options are taken anywhere. A word that starts with a dash and a digit is
 * an operand: a value.
 */
#ifndef CLI_ARGS_H
#define CLI_ARGS_H

#include <stddef.h>
#include <stdint.h>

#include "cli/cli.h"

enum args_kind {
	ARGS_FLAG,     /* int: 1 */
	ARGS_TEXT,     /* const char * */
	ARGS_COUNT,    /* uint64_t, at least 1 */
	ARGS_NUMBER,   /* double, above 0 */
	ARGS_DURATION, /* int64_t ns, above 0 */
	ARGS_DC_TIME,  /* int64_t ns */
};

struct args_option {
	const char *name; /* without dashes */
	char letter;      /* 0: none */
	enum args_kind kind;
	void *target;
	const char *value; /* what --help calls its value; NULL for a flag */
	const char *help;
};

struct args {
	const struct args_option *options;
	size_t option_count;
	int operands_min;
	int operands_max; /* INT_MAX: any */
	char **operands;  /* out: argv's own words */
	int operand_count;
};

enum args_result { ARGS_GO, ARGS_DONE };

/**
 * Sort @argv (without the verb itself) into options and operands. ARGS_GO; ARGS_DONE when --help
 * was answered or a mistake was said, with the exit code in @ret_exit.
 */
enum args_result args_parse(struct cli *cli, struct args *args, int argc, char **argv,
			    enum exit_code *ret_exit);

/** Take a global option at @argv[@index]. Words taken; 0 if it is none; -1 if a mistake was said.
 */
int args_take_global(struct cli *cli, int argc, char **argv, int index);

#endif
