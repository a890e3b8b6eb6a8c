/* SPDX-License-Identifier: MIT */
/*
 * Start-up SDOs as the file has them: the short form, one line, is cut into the options of the long
 * one. Private to config/. Context: any.
 */
#ifndef CONFIG_STARTUP_H
#define CONFIG_STARTUP_H

#include "config/option.h"

enum { STARTUP_FIELDS = 7 };

struct startup_field {
	const char *name; /* "transition", "index": of the option */
	char text[CONFIG_OPTIONS_BYTES];
};

struct startup_line {
	struct startup_field field[STARTUP_FIELDS];
	unsigned count;
};

/* What a line looks like, for messages, and as a regular expression. */
#define STARTUP_LINE_FORM "PS 0x8000:01 UINT = 3  # comment"
#define STARTUP_LINE_PATTERN                                                                       \
	"^ *([IiPpSsOo]{2} +)?0[xX][0-9a-fA-F]{1,4}(:(0[xX])?[0-9a-fA-F]{1,2})?( +complete)?"      \
	"( +[a-zA-Z]+)? *=.*$"

/** Cut @text. 0, or -EINVAL with @reason (OPTION_WHY_BYTES). */
int startup_line_cut(const char *text, struct startup_line *ret_line, char *reason);

#endif
