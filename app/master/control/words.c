/* SPDX-License-Identifier: MIT */
#include "control/words.h"

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

static int take_word(struct words *words, char *text, char *why, size_t why_bytes)
{
	char *equals = strchr(text, '=');
	const char *key;
	const char *value;

	if (equals == NULL) {
		snprintf(why, why_bytes, "\"%.40s\" is not KEY=VALUE", trim(text));
		return -EINVAL;
	}
	*equals = '\0';
	key = trim(text);
	value = trim(equals + 1);
	if (key[0] == '\0') {
		snprintf(why, why_bytes, "\"=%.40s\" has no key", value);
		return -EINVAL;
	}
	for (size_t i = 0; i < words->count; i++) {
		if (strcmp(words->word[i].key, key) == 0) {
			snprintf(why, why_bytes, "%.40s is given twice", key);
			return -EINVAL;
		}
	}
	if (words->count == WORDS_LIMIT) {
		snprintf(why, why_bytes, "more than WORDS_LIMIT = %d", WORDS_LIMIT);
		return -E2BIG;
	}
	words->word[words->count++] = (struct word){ .key = key, .value = value };
	return 0;
}

int words_parse(struct words *words, const char *text, char *why, size_t why_bytes)
{
	char *rest = words->text;

	words->count = 0;
	if (snprintf(words->text, sizeof(words->text), "%s", text) >= (int)sizeof(words->text)) {
		snprintf(why, why_bytes, "too long");
		return -E2BIG;
	}
	while (*rest != '\0') {
		char *end = rest + strcspn(rest, ",");
		char *next = *end == ',' ? end + 1 : end;
		int r;

		*end = '\0';
		r = *trim(rest) == '\0' ? 0 : take_word(words, rest, why, why_bytes);
		if (r < 0) {
			return r;
		}
		rest = next;
	}
	return 0;
}

const char *words_ask(struct words *words, const char *key)
{
	for (size_t i = 0; i < words->count; i++) {
		if (strcmp(words->word[i].key, key) == 0) {
			words->word[i].was_asked = 1;
			return words->word[i].value;
		}
	}
	return NULL;
}

const char *words_unasked(const struct words *words)
{
	for (size_t i = 0; i < words->count; i++) {
		if (!words->word[i].was_asked) {
			return words->word[i].key;
		}
	}
	return NULL;
}
