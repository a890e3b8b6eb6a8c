/* SPDX-License-Identifier: MIT */
/*
 * What a page may ask for, and which verb of `ecdaq` does it. The tool checks channel, type, limits
 * and state, as it does for an operator at a terminal; here are only role, number and form of the
 * words, so that none of them can be an option. Context: any.
 */
#ifndef WEB_COMMAND_H
#define WEB_COMMAND_H

#include "base/web_command.h"
#include "web/sessions.h"

enum { COMMAND_LINES = 8, COMMAND_WORDS = 10, COMMAND_WORD_BYTES = 160 };

/* The lines of a body. */
struct command_body {
	int count;
	char *line[COMMAND_LINES];
	char text[WEB_BODY_BYTES];
};

/* The arguments of ecdaq; word[count] is NULL. */
struct command {
	enum role role;     /* that it takes, at least */
	unsigned exchanges; /* with a mailbox at most, paced; 0: it is done at once */
	int is_watching;    /* only reads: no use of the session, no line in the log */
	int count;
	const char *word[COMMAND_WORDS + 1];
	char joined[COMMAND_WORD_BYTES]; /* CHANNEL=VALUE */
};

/** Take the lines out of @text. 0; -EBADMSG: no printable ASCII, an empty line, or too many. */
int command_body_parse(const char text[WEB_BODY_BYTES], struct command_body *ret);
/** The command of @line[0] to @line[count - 1]. 0; -ENOENT: there is none of that name; -EINVAL:
 * another number or form of words. @ret refers to @line. */
int command_parse(char *const line[], int count, struct command *ret);

#endif
