/* SPDX-License-Identifier: MIT */
/* control.options: "kp=0.5, channel=piccolo0.led". Context: any. */
#ifndef CONTROL_WORDS_H
#define CONTROL_WORDS_H

#include <stddef.h>

#include "config/config.h"

enum { WORDS_LIMIT = 32 };

struct word {
	const char *key;
	const char *value;
	int was_asked;
};

struct words {
	char text[CONFIG_OPTIONS_BYTES]; /* with zeros where commas and equal signs were */
	struct word word[WORDS_LIMIT];
	size_t count;
};

/** 0, or -EINVAL or -E2BIG with the reason in @why. */
int words_parse(struct words *words, const char *text, char *why, size_t why_bytes);
/** The value of @key, which counts as asked for; NULL: not given. */
const char *words_ask(struct words *words, const char *key);
/** A key that nobody has asked for; NULL: none. */
const char *words_unasked(const struct words *words);

#endif
