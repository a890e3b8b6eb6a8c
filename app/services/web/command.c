/* SPDX-License-Identifier: MIT */
#include "web/command.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define DIGITS "0123456789"
#define LETTERS "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"

enum { OPERANDS = 4, FIXED = 6 };

/* What a word may be made of. */
static const char channel_form[] = DIGITS LETTERS "_.[]():#/-";
static const char value_form[] = DIGITS LETTERS "_.+-";
static const char state_form[] = LETTERS;
static const char type_form[] = LETTERS;
static const char position_form[] = DIGITS;
static const char object_form[] = DIGITS "abcdefx:";

static const struct {
	const char *name;
	enum role role;
	int operands_min;
	int operands_max;
	const char *form[OPERANDS];
	const char *verb[FIXED]; /* with its options; the operands follow */
	int is_pair;             /* the operands are one word, with = between */
	unsigned exchanges;
	int is_watching;
} commands[] = {
	{ "set", ROLE_OPERATOR, 2, 2, { channel_form, value_form }, { "set", "--json" }, 1, 0, 0 },
	{ "state", ROLE_ENGINEER, 1, 2, { state_form, position_form }, { "state" }, 0, 0, 0 },
	{ "rescan", ROLE_ENGINEER, 0, 0, { NULL }, { "rescan", "--force" }, 0, 0, 0 },
	{ "clear", ROLE_ENGINEER, 0, 0, { NULL }, { "clear" }, 0, 0, 0 },
	{ "errors", ROLE_ENGINEER, 1, 1, { position_form }, { "crc", "--reset" }, 0, 0, 0 },
	/* The dictionary of a slave: in parts, whose answers fit into a reply. */
	{ "objects",
	  ROLE_OPERATOR,
	  2,
	  2,
	  { position_form, object_form },
	  { "sdo", "list", "--json", "--indices", "--count", "1000" },
	  0,
	  1,
	  1 },
	{ "object",
	  ROLE_OPERATOR,
	  2,
	  2,
	  { position_form, object_form },
	  { "sdo", "list", "--json", "--count", "4" },
	  0,
	  5,
	  1 },
	{ "read",
	  ROLE_OPERATOR,
	  2,
	  2,
	  { position_form, object_form },
	  { "sdo", "read", "--json" },
	  0,
	  1,
	  1 },
	{ "write",
	  ROLE_ENGINEER,
	  4,
	  4,
	  { type_form, position_form, object_form, value_form },
	  { "sdo", "write", "--type" },
	  0,
	  1,
	  0 },
};

int command_body_parse(const char text[WEB_BODY_BYTES], struct command_body *ret)
{
	size_t len = strnlen(text, WEB_BODY_BYTES);
	char *at = ret->text;

	ret->count = 0;
	if (len == 0 || len == WEB_BODY_BYTES) {
		return -EBADMSG;
	}
	memcpy(ret->text, text, len + 1);
	while (ret->count < COMMAND_LINES) {
		size_t bytes = strcspn(at, "\n");
		int is_last = at[bytes] == '\0';

		if (bytes == 0) {
			return -EBADMSG;
		}
		for (size_t i = 0; i < bytes; i++) {
			if (at[i] < ' ' || at[i] > '~') {
				return -EBADMSG;
			}
		}
		at[bytes] = '\0';
		ret->line[ret->count++] = at;
		if (is_last) {
			return 0;
		}
		at += bytes + 1;
	}
	return -EBADMSG;
}

/* A word with a dash in front may be a number or behind a =, but no option. */
static int has_form(const char *word, const char *form, int is_joined)
{
	int is_number = (word[1] >= '0' && word[1] <= '9') || word[1] == '.';

	return (word[0] != '-' || is_joined || (form == value_form && is_number)) &&
	       word[strspn(word, form)] == '\0';
}

int command_parse(char *const line[], int count, struct command *ret)
{
	size_t i = 0;
	int operands = count - 1;

	while (i < sizeof(commands) / sizeof(commands[0]) && count > 0 &&
	       strcmp(line[0], commands[i].name) != 0) {
		i++;
	}
	if (i == sizeof(commands) / sizeof(commands[0]) || count == 0) {
		return -ENOENT;
	}
	if (operands < commands[i].operands_min || operands > commands[i].operands_max) {
		return -EINVAL;
	}
	memset(ret, 0, sizeof(*ret));
	ret->role = commands[i].role;
	ret->exchanges = commands[i].exchanges;
	ret->is_watching = commands[i].is_watching;
	for (int k = 0; k < FIXED && commands[i].verb[k] != NULL; k++) {
		ret->word[ret->count++] = commands[i].verb[k];
	}
	for (int k = 0; k < operands; k++) {
		if (!has_form(line[k + 1], commands[i].form[k], commands[i].is_pair && k > 0)) {
			return -EINVAL;
		}
		ret->word[ret->count + k] = line[k + 1];
	}
	if (commands[i].is_pair) {
		int bytes = snprintf(ret->joined, sizeof(ret->joined), "%s=%s", line[1], line[2]);

		ret->word[ret->count++] = ret->joined;
		ret->word[ret->count] = NULL;
		return bytes < (int)sizeof(ret->joined) ? 0 : -EINVAL;
	}
	ret->count += operands;
	return 0;
}
