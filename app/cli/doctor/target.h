/* SPDX-License-Identifier: MIT */
/*
 * What a machine is judged against: the configuration of the ecdaqd that runs there, by its command
 * line; else the appliance's; else the defaults. Context: blocking.
 */
#ifndef CLI_DOCTOR_TARGET_H
#define CLI_DOCTOR_TARGET_H

#include <stddef.h>
#include <stdint.h>

#include "cli/doctor/sight.h"
#include "config/config.h"

enum { TARGET_TEXT_BYTES = 16384, TARGET_SETS = 256 };

/* What of a command line of ecdaqd makes its configuration; strings point into the text. */
struct target_words {
	const char *config; /* NULL: none */
	const char *interface;
	const char *set[TARGET_SETS];
	size_t set_count;
};

/** Cut @text at each @separator and find the options; what is unknown is passed over. */
void target_parse(char *text, size_t text_len, char separator, struct target_words *ret);

/** The process ecdaqd; 0: none is seen. */
int64_t target_find_daemon(const struct sight *s);

/**
 * The configuration, with the command line of process @pid (0: none runs). In @ret_name where it
 * comes from, for people, and what of it could not be read.
 */
void target_load(const struct sight *s, int64_t pid, struct config *ret_cfg,
		 char ret_name[SIGHT_PATH_BYTES]);

#endif
