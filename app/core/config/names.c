/* SPDX-License-Identifier: MIT */
/* Names of options, lists and sections: what is there, and what may have been meant. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "config/option.h"

int option_list_find(const char *name)
{
	for (int i = 0; i < OPTION_LISTS; i++) {
		if (strcmp(option_lists[i].name, name) == 0) {
			return i;
		}
	}
	return -ENOENT;
}

void option_list_prefix(const struct option_list *list, char ret_prefix[])
{
	snprintf(ret_prefix, OPTION_KEY_BYTES, "%s[].",
		 list->like != NULL ? list->like : list->name);
}

int option_is_section(const char *name)
{
	size_t len = strlen(name);

	for (size_t i = 0; i < option_count(); i++) {
		if (strncmp(option_at(i)->name, name, len) == 0 && option_at(i)->name[len] == '.') {
			return 1;
		}
	}
	return 0;
}

static unsigned min3(unsigned a, unsigned b, unsigned c)
{
	unsigned ab = a < b ? a : b;

	return ab < c ? ab : c;
}

/* Insertions, deletions and changes between @a and @b. */
static unsigned edit_distance(const char *a, const char *b)
{
	unsigned row[OPTION_KEY_BYTES + 1];
	size_t b_len = strlen(b);

	if (b_len > OPTION_KEY_BYTES) {
		return OPTION_KEY_BYTES;
	}
	for (size_t j = 0; j <= b_len; j++) {
		row[j] = (unsigned)j;
	}
	for (size_t i = 0; a[i] != '\0'; i++) {
		unsigned diagonal = row[0];

		row[0] = (unsigned)i + 1;
		for (size_t j = 0; j < b_len; j++) {
			unsigned cost = diagonal + (a[i] != b[j]);

			diagonal = row[j + 1];
			row[j + 1] = min3(cost, row[j] + 1, diagonal + 1);
		}
	}
	return row[b_len];
}

static const char *last_part(const char *name)
{
	const char *dot = strrchr(name, '.');

	return dot == NULL ? name : dot + 1;
}

struct guess {
	const char *name;
	unsigned distance;
};

static void consider(struct guess *guess, const char *meant, const char *candidate)
{
	unsigned distance = edit_distance(meant, candidate);

	/* The right key under the wrong section beats any misspelling of more than a letter. */
	if (distance > 1 && strcmp(last_part(meant), last_part(candidate)) == 0) {
		distance = 1;
	}
	if (distance < guess->distance) {
		guess->name = candidate;
		guess->distance = distance;
	}
}

const char *option_suggest(const char *name)
{
	struct guess guess = { .name = NULL, .distance = 2 + (unsigned)(strlen(name) / 4) };

	if (strlen(name) > OPTION_KEY_BYTES) {
		return NULL;
	}
	for (size_t i = 0; i < option_count(); i++) {
		consider(&guess, name, option_at(i)->name);
	}
	for (size_t i = 0; i < option_section_count; i++) {
		consider(&guess, name, option_sections[i].name);
	}
	for (int i = 0; i < OPTION_LISTS; i++) {
		consider(&guess, name, option_lists[i].name);
	}
	return guess.name;
}

void option_make_plain(char *text)
{
	for (; *text != '\0'; text++) {
		if (*text < 0x20 || *text > 0x7e) {
			*text = '?';
		}
	}
}
