/* SPDX-License-Identifier: MIT */
/*
 * The command line of a program that runs until it is stopped: the options that all of them have
 * (--config, --set, --run-dir, --check, --version, --help), its own, and the configuration they
 * give. Overrides come before the check, in every program. Context: blocking, at start.
 */
#ifndef PROGRAM_COMMAND_LINE_H
#define PROGRAM_COMMAND_LINE_H

#include <stddef.h>
#include <stdint.h>

#include "base/args.h"
#include "config/config.h"
#include "program/exit_code.h"

enum { COMMAND_LINE_OVERRIDES = 7 };

/* An option of the command line that stands for one of the configuration: --interface NIC for
 * --set bus.interface=NIC. */
struct command_line_override {
	const char *option;       /* "bus.interface" */
	const char *const *value; /* target of the command line's; *value NULL: not given */
};

struct command_line {
	const char *program;               /* "ecdaq-record" */
	const char *summary;               /* what it does, for --help */
	const struct args_option *options; /* its own */
	size_t option_count;
	const struct command_line_override *overrides; /* COMMAND_LINE_OVERRIDES at most */
	size_t override_count;
	const char *notes;       /* end of --help; NULL: none */
	uint32_t exit_codes;     /* EXIT_CODE_BIT()s, for --help */
	const char *config_path; /* out: NULL: the built-in defaults */
	int is_check;            /* out: --check: report and exit */
	/* out: where the configuration comes from, to read it again; valid until the end */
	struct config_source source;
};

enum command_line_result { COMMAND_LINE_RUN, COMMAND_LINE_EXIT };

/**
 * Parse @argv, then fill @ret_cfg: the defaults, the file, each --set in order, the overrides
 * (--run-dir and those of @line); and check it. COMMAND_LINE_EXIT with @ret_code when nothing is
 * left to do: --help or --version was answered, or an error was reported.
 */
enum command_line_result command_line_read(struct command_line *line, int argc, char **argv,
					   struct config *ret_cfg, enum exit_code *ret_code);

/** The answer to --check: "FILE: valid". Returns EXIT_CODE_OK. */
enum exit_code command_line_valid(const struct command_line *line);
/** Report that @option ("dds.enable") is off. EXIT_CODE_OK; with --check EXIT_CODE_DISABLED. */
enum exit_code command_line_disabled(const struct command_line *line, const char *option);

#endif
