/* SPDX-License-Identifier: MIT */
/* The texts of app/sim/catalogue, as the build puts them into one C file. */
#ifndef SIM_DEVICES_CATALOGUE_TEXTS_H
#define SIM_DEVICES_CATALOGUE_TEXTS_H

#include <stddef.h>

struct catalogue_text {
	const char *name; /* of the file, without .txt */
	const char *text;
};

extern const struct catalogue_text catalogue_texts[]; /* in alphabetical order */
extern const size_t catalogue_text_count;

#endif
