/* SPDX-License-Identifier: MIT */
#include "base/args.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { HELP_COLUMN = 23, HELP_WIDTH = 80 };

int args_flag(const char *text, void *target, char *why)
{
	(void)text;
	why[0] = '\0';
	*(int *)target = 1;
	return 0;
}

int args_text(const char *text, void *target, char *why)
{
	why[0] = '\0';
	*(const char **)target = text;
	return 0;
}

int args_list(const char *text, void *target, char *why)
{
	struct args_list *list = target;

	if (list->count == ARGS_LIST_LIMIT) {
		snprintf(why, ARGS_WHY_BYTES, "given more than ARGS_LIST_LIMIT = %d times",
			 ARGS_LIST_LIMIT);
		return -E2BIG;
	}
	list->item[list->count++] = text;
	return 0;
}

static int refuse(char *why, const char *text, const char *expected)
{
	snprintf(why, ARGS_WHY_BYTES, "\"%.64s\": expected %s", text, expected);
	return -EINVAL;
}

static int parse_unsigned(const char *text, uint64_t *ret)
{
	unsigned long long value;
	char *end;

	if (text[0] < '0' || text[0] > '9') {
		return -EINVAL;
	}
	errno = 0;
	value = strtoull(text, &end, 10);
	if (errno != 0 || *end != '\0') {
		return -EINVAL;
	}
	*ret = value;
	return 0;
}

int args_count(const char *text, void *target, char *why)
{
	uint64_t value = 0;

	if (parse_unsigned(text, &value) < 0 || value == 0) {
		return refuse(why, text, "a whole number above 0");
	}
	*(uint64_t *)target = value;
	return 0;
}

int args_cycle(const char *text, void *target, char *why)
{
	return parse_unsigned(text, target) < 0 ? refuse(why, text, "a cycle number") : 0;
}

int args_number(const char *text, void *target, char *why)
{
	char *end;
	double value = strtod(text, &end);

	if (strpbrk(text, "0123456789") == NULL || *end != '\0' || !isfinite(value) || value <= 0) {
		return refuse(why, text, "a number above 0");
	}
	*(double *)target = value;
	return 0;
}

int args_integer(const char *text, void *target, char *why)
{
	struct args_integer *integer = target;
	long long value;
	char *end;

	errno = 0;
	value = strtoll(text, &end, 0);
	if (errno != 0 || end == text || *end != '\0' || value < integer->low ||
	    value > integer->high) {
		snprintf(why, ARGS_WHY_BYTES,
			 "\"%.64s\": expected a whole number from %" PRId64 " to %" PRId64, text,
			 integer->low, integer->high);
		return -ERANGE;
	}
	integer->value = value;
	return 0;
}

int args_dc_time(const char *text, void *target, char *why)
{
	long long value;
	char *end;

	errno = 0;
	value = strtoll(text, &end, 10);
	if (errno != 0 || end == text || *end != '\0') {
		return refuse(why, text, "a DC time in ns");
	}
	*(int64_t *)target = value;
	return 0;
}

/* 1 if @word is --@name or --@name=VALUE (then with the value), or the option's letter. */
static int is_option(const char *word, const char *name, char letter, const char **ret_value)
{
	size_t len = strlen(name);

	*ret_value = NULL;
	if (letter != 0 && word[1] == letter && word[2] == '\0') {
		return 1;
	}
	if (strncmp(word, "--", 2) != 0 || strncmp(word + 2, name, len) != 0) {
		return 0;
	}
	if (word[2 + len] == '=') {
		*ret_value = word + 3 + len;
		return 1;
	}
	return word[2 + len] == '\0';
}

static const struct args_option *find(const struct args *args, const char *word,
				      const char **ret_value)
{
	for (size_t i = 0; i < args->option_count + args->shared_count; i++) {
		const struct args_option *option = i < args->option_count
							   ? &args->options[i]
							   : &args->shared[i - args->option_count];

		if (is_option(word, option->name, option->letter, ret_value)) {
			return option;
		}
		if (option->value != NULL && option->letter != 0 && word[1] == option->letter) {
			*ret_value = word + 2;
			return option;
		}
	}
	return NULL;
}

/* Take the option at argv[0]: words taken, or -EINVAL with @error. */
static int take_option(const struct args *args, int argc, char **argv, char *error)
{
	const char *value;
	const struct args_option *option = find(args, argv[0], &value);
	char why[ARGS_WHY_BYTES] = "";
	int taken = 1;

	if (option == NULL) {
		snprintf(error, ARGS_ERROR_BYTES, "%.200s: unknown option", argv[0]);
		return -EINVAL;
	}
	if (option->value == NULL && value != NULL) {
		snprintf(error, ARGS_ERROR_BYTES, "--%s: takes no value", option->name);
		return -EINVAL;
	}
	if (option->value != NULL && value == NULL && argc > 1) {
		value = argv[1];
		taken = 2;
	}
	if (option->value != NULL && (value == NULL || value[0] == '\0')) {
		snprintf(error, ARGS_ERROR_BYTES, "--%s: missing value", option->name);
		return -EINVAL;
	}
	if (option->parse(value, option->target, why) < 0) {
		snprintf(error, ARGS_ERROR_BYTES, "--%s: %s", option->name, why);
		return -EINVAL;
	}
	return taken;
}

static int is_operand(const char *word)
{
	return word[0] != '-' || word[1] == '\0' || (word[1] >= '0' && word[1] <= '9') ||
	       word[1] == '.';
}

enum args_result args_check_operands(const struct args *args, char *error)
{
	if (args->operand_count < args->operands_min) {
		snprintf(error, ARGS_ERROR_BYTES, "missing %s",
			 args->operands_usage != NULL ? args->operands_usage : "argument");
		return ARGS_ERROR;
	}
	if (args->operand_count > args->operands_max && !args->ends_at_operand) {
		snprintf(error, ARGS_ERROR_BYTES, "%.200s: unexpected argument",
			 args->operands[args->operands_max]);
		return ARGS_ERROR;
	}
	return ARGS_OK;
}

enum args_result args_parse(struct args *args, int argc, char **argv, char *error)
{
	int is_over = 0; /* "--" was seen */

	args->operands = argv;
	args->operand_count = 0;
	for (int i = 0; i < argc;) {
		const char *value;
		int taken;

		if (is_over || is_operand(argv[i])) {
			if (args->ends_at_operand) {
				args->operands = argv + i;
				args->operand_count = argc - i;
				break;
			}
			argv[args->operand_count++] = argv[i++];
			continue;
		}
		if (strcmp(argv[i], "--") == 0) {
			is_over = 1;
			i++;
			continue;
		}
		if (is_option(argv[i], "help", 'h', &value) && value == NULL) {
			return ARGS_HELP;
		}
		if (is_option(argv[i], "version", 0, &value) && value == NULL) {
			return ARGS_VERSION;
		}
		taken = take_option(args, argc - i, argv + i, error);
		if (taken < 0) {
			return ARGS_ERROR;
		}
		i += taken;
	}
	return args->checks_later ? ARGS_OK : args_check_operands(args, error);
}

/* @text from HELP_COLUMN on; what does not fit goes to lines of its own. */
static void put_wrapped(FILE *out, const char *text, int column)
{
	while (*text != '\0') {
		int len = (int)strcspn(text, " ");

		if (column > HELP_COLUMN && column + 1 + len > HELP_WIDTH) {
			fprintf(out, "\n%*s", HELP_COLUMN, "");
			column = HELP_COLUMN;
		}
		column += fprintf(out, "%s%.*s", column > HELP_COLUMN ? " " : "", len, text);
		text += len + (text[len] == ' ');
	}
	fputc('\n', out);
}

static void put_option(FILE *out, const struct args_option *option)
{
	int len = option->letter == 0 ? fprintf(out, "  --%s", option->name)
				      : fprintf(out, "  -%c, --%s", option->letter, option->name);

	if (option->value != NULL) {
		len += fprintf(out, " %s", option->value);
	}
	if (len < HELP_COLUMN - 1) {
		fprintf(out, "%*s", HELP_COLUMN - len, "");
		len = HELP_COLUMN;
	} else {
		fprintf(out, "\n%*s", HELP_COLUMN, "");
		len = HELP_COLUMN;
	}
	put_wrapped(out, option->help, len);
}

void args_help(FILE *out, const struct args_option *options, size_t option_count)
{
	for (size_t i = 0; i < option_count; i++) {
		if (options[i].help != NULL) {
			put_option(out, &options[i]);
		}
	}
}

void args_help_common(FILE *out)
{
	static const struct args_option common[] = {
		{ "version", 0, args_flag, NULL, NULL, "print the version and exit" },
		{ "help", 'h', args_flag, NULL, NULL, "print this text and exit" },
	};

	args_help(out, common, sizeof(common) / sizeof(common[0]));
}
