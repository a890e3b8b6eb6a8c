/* SPDX-License-Identifier: MIT */
/* The values of channels in place: name, value, unit, good or bad, age. Context: main thread. */
#ifndef CLI_VALUE_TABLE_H
#define CLI_VALUE_TABLE_H

#include <stdio.h>

#include "cli/choose.h"
#include "cli/source.h"

enum value_table_sort {
	VALUE_TABLE_AS_GIVEN,
	VALUE_TABLE_BAD_FIRST,
	VALUE_TABLE_BY_NAME,
	VALUE_TABLE_SORT_COUNT,
};

struct value_table {
	const struct samples *samples; /* these are kept by the caller */
	const struct choice *choice;
	int is_raw;
	int64_t good_mono_ns[CHOOSE_LIMIT]; /* of the newest good sample; 0: none yet */
	int is_bad[CHOOSE_LIMIT];
};

/** Begin anew, with the channels of @choice. */
void value_table_init(struct value_table *table, const struct samples *samples,
		      const struct choice *choice, int is_raw);
/** Take the sample that was read last. */
void value_table_take(struct value_table *table);

/** The heading, and the rows of the newest sample, in up to @columns; ages are those at @mono_ns.
 */
void value_table_write_heading(const struct value_table *table, int columns, FILE *out);
void value_table_write(const struct value_table *table, enum value_table_sort sort, int columns,
		       int64_t mono_ns, FILE *out);

#endif
