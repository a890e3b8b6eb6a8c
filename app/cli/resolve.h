/* SPDX-License-Identifier: MIT */
/*
 * What a machine is judged against: the configuration of the ecdaqd that runs there, by its command
 * line; else the appliance's; else the defaults. Context: blocking.
 */
#ifndef CLI_RESOLVE_H
#define CLI_RESOLVE_H

#include <stddef.h>
#include <stdint.h>

#include "cli/probe.h"
#include "config/config.h"

enum { RESOLVE_TEXT_BYTES = 16384, RESOLVE_SETS = 256 };

/* The options of ecdaqd that make its configuration; strings point into the text. */
struct resolve_words {
	const char *config; /* NULL: none */
	const char *interface;
	const char *set[RESOLVE_SETS];
	size_t set_count;
};

/** Cut @text at each @separator and find the options; unknown words are ignored. */
void resolve_parse(char *text, size_t text_len, char separator, struct resolve_words *ret);

/** The process ecdaqd; 0: none is seen. */
int64_t resolve_find_daemon(const struct probe *p);

/** The command line of ecdaqd, process @pid, or that of its next start, by @text
 * (RESOLVE_TEXT_BYTES). 0: neither is known. */
int resolve_words(const struct probe *p, int64_t pid, char *text, struct resolve_words *ret);
/** Where the file of that command line is, as seen from here. 0 or -ENAMETOOLONG. */
int resolve_config_path(const struct probe *p, int64_t pid, const char *config,
			char ret_path[PROBE_PATH_BYTES]);

/**
 * The configuration, with the command line of process @pid (0: none runs). In @ret_name where it
 * comes from, for people, and what of it could not be read.
 */
void resolve_load(const struct probe *p, int64_t pid, struct config *ret_cfg,
		  char ret_name[PROBE_PATH_BYTES]);

#endif
