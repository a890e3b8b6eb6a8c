/* SPDX-License-Identifier: MIT */
/* The text of one value into a field, type by type. */
#include <assert.h>
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "config/number.h"
#include "config/option.h"

void option_store(const struct option *option, uint64_t value, void *base)
{
	char *field = (char *)base + option->offset;
	uint32_t v32 = (uint32_t)value;
	uint16_t v16 = (uint16_t)value;
	uint8_t v8 = (uint8_t)value;

	switch (option->bytes) {
	case 1:
		memcpy(field, &v8, sizeof(v8));
		break;
	case 2:
		memcpy(field, &v16, sizeof(v16));
		break;
	case 4:
		memcpy(field, &v32, sizeof(v32));
		break;
	default:
		assert(option->bytes == 8);
		memcpy(field, &value, sizeof(value));
		break;
	}
}

static int parse_switch(const struct option *option, const char *text, void *base, char *reason)
{
	static const char *const words[2][4] = { { "off", "false", "no", "0" },
						 { "on", "true", "yes", "1" } };

	for (unsigned value = 0; value < 2; value++) {
		for (unsigned i = 0; i < 4; i++) {
			if (strcasecmp(words[value][i], text) == 0) {
				option_store(option, value, base);
				return 0;
			}
		}
	}
	snprintf(reason, OPTION_WHY_BYTES, "expected on or off, not \"%.32s\"", text);
	return -EINVAL;
}

/* Which of the option's words @text is; -1. */
static int word_number(const struct option *option, const char *text)
{
	size_t text_len = strlen(text);
	const char *word = option->words;
	int number = 0;

	while (*word != '\0') {
		size_t len = strcspn(word, "|");

		if (len == text_len && strncasecmp(word, text, len) == 0) {
			return number;
		}
		word += len + (word[len] == '|');
		number++;
	}
	return -1;
}

/* A number, or one of the words beside them. */
static int parse_hex(const struct option *option, const char *text, void *base, char *reason)
{
	int word = option->words != NULL ? word_number(option, text) : -1;
	uint64_t behind = option->max != NULL ? strtoull(option->max, NULL, 0) : 0;

	if (word < 0) {
		return number_parse_whole(option, text, base, reason);
	}
	option_store(option, word == 0 ? 0 : behind + (unsigned)word, base);
	return 0;
}

static int parse_word(const struct option *option, const char *text, void *base, char *reason)
{
	int word = word_number(option, text);

	if (word >= 0) {
		option_store(option, (unsigned)word, base);
		return 0;
	}
	snprintf(reason, OPTION_WHY_BYTES, "expected one of %s, not \"%.32s\"", option->words,
		 text);
	return -EINVAL;
}

static int parse_text(const struct option *option, const char *text, void *base, char *reason)
{
	static const char name_chars[] =
		"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";

	if (strlen(text) >= option->bytes) {
		snprintf(reason, OPTION_WHY_BYTES, "is longer than %zu bytes", option->bytes - 1);
		return -ERANGE;
	}
	if (option->type == OPTION_NAME && text[strspn(text, name_chars)] != '\0') {
		snprintf(reason, OPTION_WHY_BYTES,
			 "expected letters, digits, _ and - only, not \"%.32s\"", text);
		return -EINVAL;
	}
	for (const char *p = text; *p != '\0'; p++) {
		if ((unsigned char)*p < 0x20 || *p == 0x7f) {
			snprintf(reason, OPTION_WHY_BYTES, "contains a control character");
			return -EINVAL;
		}
	}
	memset((char *)base + option->offset, 0, option->bytes);
	memcpy((char *)base + option->offset, text, strlen(text));
	return 0;
}

int option_parse(const struct option *option, const char *text, void *base, char *reason)
{
	switch (option->type) {
	case OPTION_DURATION:
	case OPTION_SIZE:
	case OPTION_INT:
	case OPTION_UINT:
		return number_parse_whole(option, text, base, reason);
	case OPTION_HEX:
		return parse_hex(option, text, base, reason);
	case OPTION_NUMBER:
		return number_parse_real(option, text, base, reason);
	case OPTION_SWITCH:
		return parse_switch(option, text, base, reason);
	case OPTION_WORD:
		return parse_word(option, text, base, reason);
	case OPTION_TEXT:
	case OPTION_NAME:
		return parse_text(option, text, base, reason);
	}
	return -EINVAL;
}
