/* SPDX-License-Identifier: MIT */
#include "program/command_line.h"

#include <assert.h>
#include <stdio.h>

#include "program/error.h"

enum { ERROR_BYTES = 512, ASSIGNMENT_BYTES = 64 + CONFIG_OPTIONS_BYTES };

struct standard {
	const char *config_path;
	const char *run_dir;
	struct args_list set;
	int is_check;
};

enum { STANDARD_OPTIONS = 4 };

static void make_standard(struct standard *s, struct args_option options[STANDARD_OPTIONS])
{
	const struct args_option table[STANDARD_OPTIONS] = {
		{ "config", 0, args_text, &s->config_path, "FILE",
		  "ecdaq.yaml (default: built-in defaults)" },
		{ "set", 0, args_list, &s->set, "OPTION=VALUE",
		  "set one option over the file: cycle.period=500us; may be repeated" },
		{ "run-dir", 0, args_text, &s->run_dir, "DIR",
		  "run directory of ecdaqd: rings, status page, sockets (runtime.run_dir)" },
		{ "check", 0, args_flag, &s->is_check, NULL,
		  "check the configuration, report and exit" },
	};

	for (size_t i = 0; i < STANDARD_OPTIONS; i++) {
		options[i] = table[i];
	}
}

static void help(const struct command_line *line, const struct args_option *standard)
{
	printf("usage: %s [OPTION...]\n\n%s\n", line->program, line->summary);
	args_help(stdout, standard, STANDARD_OPTIONS);
	args_help(stdout, line->options, line->option_count);
	args_help_common(stdout);
	printf("\n%s%s", line->notes != NULL ? line->notes : "", line->notes != NULL ? "\n" : "");
	exit_code_help(stdout, line->exit_codes);
}

/* --run-dir and the overrides of @line as assignments after those of --set. 0, or -E2BIG. */
static int append_overrides(const struct command_line *line, struct standard *s,
			    char text[][ASSIGNMENT_BYTES], char *error)
{
	const struct command_line_override run_dir = { "runtime.run_dir", &s->run_dir };
	int r = 0;

	assert(line->override_count <= COMMAND_LINE_OVERRIDES);
	for (size_t i = 0; r == 0 && i <= line->override_count; i++) {
		const struct command_line_override *o = i == 0 ? &run_dir : &line->overrides[i - 1];

		if (*o->value != NULL) {
			/* A value that is cut here is still longer than any option takes. */
			snprintf(text[i], ASSIGNMENT_BYTES, "%s=%s", o->option, *o->value);
			r = args_list(text[i], &s->set, error);
		}
	}
	return r;
}

enum command_line_result command_line_read(struct command_line *line, int argc, char **argv,
					   struct config *ret_cfg, enum exit_code *ret_code)
{
	static struct standard s; /* large, and filled once at start */
	struct args_option standard[STANDARD_OPTIONS];
	struct args args = { .options = line->options,
			     .option_count = line->option_count,
			     .shared = standard,
			     .shared_count = STANDARD_OPTIONS };
	static char overrides[COMMAND_LINE_OVERRIDES + 1][ASSIGNMENT_BYTES]; /* as long as @s */
	char error[ERROR_BYTES] = "";

	s = (struct standard){ .config_path = NULL };
	make_standard(&s, standard);
	*ret_code = EXIT_CODE_OK;
	switch (args_parse(&args, argc - 1, argv + 1, error)) {
	case ARGS_HELP:
		help(line, standard);
		return COMMAND_LINE_EXIT;
	case ARGS_VERSION:
		printf("%s " ECDAQ_VERSION "\n", line->program);
		return COMMAND_LINE_EXIT;
	case ARGS_ERROR:
		error_print(line->program, "%s (see %s --help)", error, line->program);
		*ret_code = EXIT_CODE_USAGE;
		return COMMAND_LINE_EXIT;
	case ARGS_OK:
		break;
	}
	if (append_overrides(line, &s, overrides, error) < 0) {
		error_print(line->program, "--set: %s", error);
		*ret_code = EXIT_CODE_USAGE;
		return COMMAND_LINE_EXIT;
	}
	line->config_path = s.config_path;
	line->is_check = s.is_check;
	line->source = (struct config_source){ .path = s.config_path,
					       .set = s.set.item,
					       .set_count = s.set.count };
	if (config_assemble(s.config_path, s.set.item, s.set.count, ret_cfg, error, sizeof(error)) <
	    0) {
		error_print(line->program, "%s", error);
		*ret_code = EXIT_CODE_CONFIG;
		return COMMAND_LINE_EXIT;
	}
	return COMMAND_LINE_RUN;
}

enum exit_code command_line_valid(const struct command_line *line)
{
	printf("%s: valid\n", line->config_path != NULL ? line->config_path : "configuration");
	return EXIT_CODE_OK;
}

enum exit_code command_line_disabled(const struct command_line *line, const char *option)
{
	error_print(line->program, "%s is off: nothing to do", option);
	return line->is_check ? EXIT_CODE_DISABLED : EXIT_CODE_OK;
}
