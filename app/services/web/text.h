/* SPDX-License-Identifier: MIT */
/* Texts for clients: each is one JSON object that begins with its "op". Context: blocking. */
#ifndef WEB_TEXT_H
#define WEB_TEXT_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "program/json.h"

struct text {
	FILE *out;
	char *text;
	size_t len;
	struct json json; /* put the rest here */
};

/** 0; -ENOMEM. */
int text_begin(struct text *t, const char *op);
/** The object is complete. free() it. NULL without memory. */
char *text_end(struct text *t);

/* The text that all clients are sent when it changes. All zero: none. */
struct text_kept {
	char *text;
	uint64_t number; /* counts up with each text that differs from the one before */
};

/** Keep @text, which is freed, in place of that before; NULL changes nothing. */
void text_keep(struct text_kept *kept, char *text);

#endif
