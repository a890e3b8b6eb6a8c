/* SPDX-License-Identifier: MIT */
/* The one option table: the rows of options_*.c, in the order of the file. */
#include <assert.h>

#include "config/option_rows.h"

static const struct option_rows *const parts[] = {
	&option_rows_master,
	&option_rows_services,
	&option_rows_items,
};

enum { PARTS = sizeof(parts) / sizeof(parts[0]) };

size_t option_count(void)
{
	size_t count = 0;

	for (size_t i = 0; i < PARTS; i++) {
		count += parts[i]->count;
	}
	assert(count <= OPTION_LIMIT); /* struct option_lines */
	return count;
}

const struct option *option_at(size_t place)
{
	for (size_t i = 0; i < PARTS; i++) {
		if (place < parts[i]->count) {
			return &parts[i]->option[place];
		}
		place -= parts[i]->count;
	}
	return NULL;
}

size_t option_place(const struct option *option)
{
	size_t place = 0;

	while (option_at(place) != option) {
		place++;
		assert(place < OPTION_LIMIT);
	}
	return place;
}
