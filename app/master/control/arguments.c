/* SPDX-License-Identifier: MIT */
#include "control/arguments.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define SPACES " \t\r\n"

/* Without the spaces round it, in place. */
static char *trim(char *text)
{
	size_t len;

	text += strspn(text, SPACES);
	len = strlen(text);
	while (len > 0 && strchr(SPACES, text[len - 1]) != NULL) {
		text[--len] = '\0';
	}
	return text;
}

static int add_argument(struct arguments *arguments, char *text, char *reason, size_t reason_bytes)
{
	char *equals = strchr(text, '=');
	const char *key;
	const char *value;

	if (equals == NULL) {
		snprintf(reason, reason_bytes, "\"%.40s\" is not KEY=VALUE", trim(text));
		return -EINVAL;
	}
	*equals = '\0';
	key = trim(text);
	value = trim(equals + 1);
	if (key[0] == '\0') {
		snprintf(reason, reason_bytes, "\"=%.40s\" has no key", value);
		return -EINVAL;
	}
	for (size_t i = 0; i < arguments->count; i++) {
		if (strcmp(arguments->item[i].key, key) == 0) {
			snprintf(reason, reason_bytes, "%.40s: duplicate key", key);
			return -EINVAL;
		}
	}
	if (arguments->count == ARGUMENTS_LIMIT) {
		snprintf(reason, reason_bytes, "more than ARGUMENTS_LIMIT = %d", ARGUMENTS_LIMIT);
		return -E2BIG;
	}
	arguments->item[arguments->count++] = (struct argument){ .key = key, .value = value };
	return 0;
}

int arguments_parse(struct arguments *arguments, const char *text, char *reason,
		    size_t reason_bytes)
{
	char *rest = arguments->text;

	arguments->count = 0;
	if (snprintf(arguments->text, sizeof(arguments->text), "%s", text) >=
	    (int)sizeof(arguments->text)) {
		snprintf(reason, reason_bytes, "too long");
		return -E2BIG;
	}
	while (*rest != '\0') {
		char *end = rest + strcspn(rest, ",");
		char *next = *end == ',' ? end + 1 : end;
		int r;

		*end = '\0';
		r = *trim(rest) == '\0' ? 0 : add_argument(arguments, rest, reason, reason_bytes);
		if (r < 0) {
			return r;
		}
		rest = next;
	}
	return 0;
}

const char *arguments_get(struct arguments *arguments, const char *key)
{
	for (size_t i = 0; i < arguments->count; i++) {
		if (strcmp(arguments->item[i].key, key) == 0) {
			arguments->item[i].is_used = 1;
			return arguments->item[i].value;
		}
	}
	return NULL;
}

const char *arguments_unused(const struct arguments *arguments)
{
	for (size_t i = 0; i < arguments->count; i++) {
		if (!arguments->item[i].is_used) {
			return arguments->item[i].key;
		}
	}
	return NULL;
}
