/* SPDX-License-Identifier: MIT */
/* control.options: "kp=0.5, channel=piccolo0.led". Context: any. */
#ifndef CONTROL_ARGUMENTS_H
#define CONTROL_ARGUMENTS_H

#include <stddef.h>

#include "config/config.h"

enum { ARGUMENTS_LIMIT = 32 };

struct argument {
	const char *key;
	const char *value;
	int is_used;
};

struct arguments {
	char text[CONFIG_OPTIONS_BYTES]; /* with zeros where commas and equal signs were */
	struct argument item[ARGUMENTS_LIMIT];
	size_t count;
};

/** 0, or -EINVAL or -E2BIG with the reason in @reason. */
int arguments_parse(struct arguments *arguments, const char *text, char *reason,
		    size_t reason_bytes);
/** The value of @key, which is marked as used; NULL: not given. */
const char *arguments_get(struct arguments *arguments, const char *key);
/** A key that was never read; NULL: none. */
const char *arguments_unused(const struct arguments *arguments);

#endif
