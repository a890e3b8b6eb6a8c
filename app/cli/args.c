/* SPDX-License-Identifier: MIT */
#include "cli/args.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The value of the long option that @word is, if it is --@name or --@name=VALUE. */
static int is_option(const char *word, const char *name, const char **ret_value)
{
	size_t len = strlen(name);

	if (strncmp(word, "--", 2) != 0 || strncmp(word + 2, name, len) != 0) {
		return 0;
	}
	if (word[2 + len] == '=') {
		*ret_value = word + 3 + len;
		return 1;
	}
	*ret_value = NULL;
	return word[2 + len] == '\0';
}

int args_take_global(struct cli *cli, int argc, char **argv, int index)
{
	const struct {
		const char *name;
		const char **target;
	} globals[] = { { "run-dir", &cli->run_dir }, { "config", &cli->config } };
	const char *value;

	for (size_t i = 0; i < sizeof(globals) / sizeof(globals[0]); i++) {
		if (!is_option(argv[index], globals[i].name, &value)) {
			continue;
		}
		if (value != NULL) {
			*globals[i].target = value;
			return 1;
		}
		if (index + 1 >= argc) {
			cli_fail(cli, EXIT_CODE_USAGE, "--%s: wants a value", globals[i].name);
			return -1;
		}
		*globals[i].target = argv[index + 1];
		return 2;
	}
	return 0;
}

static int parse_count(const char *text, uint64_t *ret)
{
	unsigned long long value;
	char *end;

	if (text[0] < '0' || text[0] > '9') {
		return -EINVAL;
	}
	errno = 0;
	value = strtoull(text, &end, 10);
	if (errno != 0 || *end != '\0' || value == 0) {
		return -EINVAL;
	}
	*ret = value;
	return 0;
}

static int parse_number(const char *text, double *ret)
{
	char *end;
	double value;

	if (strpbrk(text, "0123456789") == NULL) {
		return -EINVAL;
	}
	value = strtod(text, &end);
	if (*end != '\0' || !isfinite(value) || value <= 0) {
		return -EINVAL;
	}
	*ret = value;
	return 0;
}

static int parse_dc_time(const char *text, int64_t *ret)
{
	long long value;
	char *end;

	errno = 0;
	value = strtoll(text, &end, 10);
	if (errno != 0 || end == text || *end != '\0') {
		return -EINVAL;
	}
	*ret = value;
	return 0;
}

static enum exit_code store(const struct cli *cli, const struct args_option *option,
			    const char *value)
{
	char why[CONFIG_WHY_BYTES];
	int64_t ns;

	switch (option->kind) {
	case ARGS_FLAG:
		*(int *)option->target = 1;
		return EXIT_CODE_OK;
	case ARGS_TEXT:
		*(const char **)option->target = value;
		return EXIT_CODE_OK;
	case ARGS_COUNT:
		if (parse_count(value, option->target) < 0) {
			return cli_fail(cli, EXIT_CODE_USAGE, "--%s: \"%s\" is no count above 0",
					option->name, value);
		}
		return EXIT_CODE_OK;
	case ARGS_NUMBER:
		if (parse_number(value, option->target) < 0) {
			return cli_fail(cli, EXIT_CODE_USAGE, "--%s: \"%s\" is no number above 0",
					option->name, value);
		}
		return EXIT_CODE_OK;
	case ARGS_DURATION:
		if (config_parse_duration(value, &ns, why) < 0) {
			return cli_fail(cli, EXIT_CODE_USAGE, "--%s: %s", option->name, why);
		}
		if (ns <= 0) {
			return cli_fail(cli, EXIT_CODE_USAGE, "--%s: %s is not above 0",
					option->name, value);
		}
		*(int64_t *)option->target = ns;
		return EXIT_CODE_OK;
	case ARGS_DC_TIME:
		if (parse_dc_time(value, option->target) < 0) {
			return cli_fail(cli, EXIT_CODE_USAGE, "--%s: \"%s\" is no DC time in ns",
					option->name, value);
		}
		return EXIT_CODE_OK;
	}
	return EXIT_CODE_USAGE;
}

static void help_option(const struct args_option *option)
{
	char head[48];

	if (option->letter != 0) {
		snprintf(head, sizeof(head), "-%c, --%s%s%s", option->letter, option->name,
			 option->value == NULL ? "" : " ",
			 option->value == NULL ? "" : option->value);
	} else {
		snprintf(head, sizeof(head), "--%s%s%s", option->name,
			 option->value == NULL ? "" : " ",
			 option->value == NULL ? "" : option->value);
	}
	printf("  %-20s %s\n", head, option->help);
}

static void help(const struct cli *cli, const struct args *args)
{
	const struct verb *verb = cli->verb;

	printf("usage: ecdaq %s%s%s%s\n\n%s\n", verb->name,
	       args->option_count > 0 ? " [OPTION...]" : "", verb->operands[0] == '\0' ? "" : " ",
	       verb->operands, verb->summary);
	if (verb->detail != NULL) {
		printf("\n%s", verb->detail);
	}
	if (args->option_count > 0) {
		putchar('\n');
	}
	for (size_t i = 0; i < args->option_count; i++) {
		help_option(&args->options[i]);
	}
}

/* Take the verb's option at @argv[@index]: words taken, or -1 for a mistake that was said. */
static int take_option(const struct cli *cli, const struct args *args, int argc, char **argv,
		       int index)
{
	const char *word = argv[index];

	for (size_t i = 0; i < args->option_count; i++) {
		const struct args_option *option = &args->options[i];
		const char *value = NULL;
		int is_short = option->letter != 0 && word[1] == option->letter && word[2] == '\0';

		if (!is_short && !is_option(word, option->name, &value)) {
			continue;
		}
		if (option->kind == ARGS_FLAG) {
			if (value != NULL) {
				cli_fail(cli, EXIT_CODE_USAGE, "--%s: takes no value",
					 option->name);
				return -1;
			}
			return store(cli, option, NULL) == EXIT_CODE_OK ? 1 : -1;
		}
		if (value != NULL) {
			return store(cli, option, value) == EXIT_CODE_OK ? 1 : -1;
		}
		if (index + 1 >= argc) {
			cli_fail(cli, EXIT_CODE_USAGE, "--%s: wants a value", option->name);
			return -1;
		}
		return store(cli, option, argv[index + 1]) == EXIT_CODE_OK ? 2 : -1;
	}
	cli_fail(cli, EXIT_CODE_USAGE, "%s: unknown option (see ecdaq %s --help)", word,
		 cli->verb->name);
	return -1;
}

static int is_operand(const char *word)
{
	return word[0] != '-' || word[1] == '\0' || (word[1] >= '0' && word[1] <= '9') ||
	       word[1] == '.';
}

static enum args_result check_operands(const struct cli *cli, const struct args *args,
				       enum exit_code *ret_exit)
{
	if (args->operand_count < args->operands_min) {
		*ret_exit = cli_fail(cli, EXIT_CODE_USAGE, "wants %s (see ecdaq %s --help)",
				     cli->verb->operands, cli->verb->name);
		return ARGS_DONE;
	}
	if (args->operand_count > args->operands_max) {
		*ret_exit = cli_fail(cli, EXIT_CODE_USAGE, "%s: one word too many",
				     args->operands[args->operands_max]);
		return ARGS_DONE;
	}
	return ARGS_GO;
}

enum args_result args_parse(struct cli *cli, struct args *args, int argc, char **argv,
			    enum exit_code *ret_exit)
{
	int is_over = 0; /* "--" was seen */

	*ret_exit = EXIT_CODE_USAGE;
	args->operands = argv;
	args->operand_count = 0;
	for (int i = 0; i < argc;) {
		int taken;

		if (is_over || is_operand(argv[i])) {
			argv[args->operand_count++] = argv[i++];
			continue;
		}
		if (strcmp(argv[i], "--") == 0) {
			is_over = 1;
			i++;
			continue;
		}
		if (strcmp(argv[i], "--help") == 0) {
			help(cli, args);
			*ret_exit = EXIT_CODE_OK;
			return ARGS_DONE;
		}
		taken = args_take_global(cli, argc, argv, i);
		if (taken == 0) {
			taken = take_option(cli, args, argc, argv, i);
		}
		if (taken < 0) {
			return ARGS_DONE;
		}
		i += taken;
	}
	return check_operands(cli, args, ret_exit);
}
