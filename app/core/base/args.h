/* SPDX-License-Identifier: MIT */
/*
 * A command line by table: --name, --name=VALUE, --name VALUE, -n, -nVALUE, and "--" after which
 * nothing is an option. Options and operands may be mixed; a word that starts with a dash and a
 * digit is an operand: a value. --help, -h and --version are options of every program. Context:
 * blocking.
 */
#ifndef BASE_ARGS_H
#define BASE_ARGS_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { ARGS_WHY_BYTES = 192, ARGS_ERROR_BYTES = 320, ARGS_LIST_LIMIT = 256 };

/**
 * Parse the value @text into @target. 0, or a negative errno with the reason in @why
 * (ARGS_WHY_BYTES) and @target untouched.
 */
typedef int args_parse_value(const char *text, void *target, char *why);

args_parse_value args_flag;    /* int: 1; its option has no value */
args_parse_value args_text;    /* const char *: into argv */
args_parse_value args_list;    /* struct args_list: appended */
args_parse_value args_count;   /* uint64_t, at least 1 */
args_parse_value args_cycle;   /* uint64_t */
args_parse_value args_number;  /* double, above 0 */
args_parse_value args_integer; /* struct args_integer: decimal, 0x or 0 */
args_parse_value args_dc_time; /* int64_t ns */

/* A whole number from @low to @high. */
struct args_integer {
	int64_t low;
	int64_t high;
	int64_t value;
};

struct args_list {
	const char *item[ARGS_LIST_LIMIT];
	size_t count;
};

struct args_option {
	const char *name; /* without dashes */
	char letter;      /* 0: none */
	args_parse_value *parse;
	void *target;
	const char *value; /* what --help calls its value; NULL for a flag */
	const char *help;  /* NULL: not listed */
};

struct args {
	const struct args_option *options;
	size_t option_count;
	const struct args_option *shared; /* a second table: options of several commands */
	size_t shared_count;
	int operands_min;
	int operands_max;           /* INT_MAX: any number */
	const char *operands_usage; /* for the error where one is missing: "CHANNEL..." */
	int checks_later;           /* 1: the caller calls args_check_operands() */
	int ends_at_operand;        /* 1: the first operand and what follows are left as they are */
	char **operands;            /* out: argv's own words */
	int operand_count;          /* out */
};

enum args_result { ARGS_OK, ARGS_HELP, ARGS_VERSION, ARGS_ERROR };

/**
 * Sort the @argc words of @argv (without the program's name) into options and operands; reorders
 * @argv. ARGS_HELP and ARGS_VERSION: asked for, the rest is not looked at. ARGS_ERROR: with a text
 * "what: problem" in @error (ARGS_ERROR_BYTES).
 */
enum args_result args_parse(struct args *args, int argc, char **argv, char *error);

/** Are there as many operands as @args says? ARGS_OK, or ARGS_ERROR with a text in @error. */
enum args_result args_check_operands(const struct args *args, char *error);

/** A line for each of @options, wrapped to 80 columns. */
void args_help(FILE *out, const struct args_option *options, size_t option_count);
/** The same of --version and --help. */
void args_help_common(FILE *out);

#endif
