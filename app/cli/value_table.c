/* SPDX-License-Identifier: MIT */
#include "cli/value_table.h"

#include <stdlib.h>
#include <string.h>

#include "cli/fit.h"
#include "cli/lines.h"
#include "cli/screen.h"
#include "cli/text.h"
#include "image/image.h"

enum { VALUE_COLUMNS = 20, UNIT_COLUMNS = 8, STATE_COLUMNS = 4, AGE_COLUMNS = 8 };
/* All but the name, with the blanks between. */
enum { REST_COLUMNS = VALUE_COLUMNS + UNIT_COLUMNS + STATE_COLUMNS + AGE_COLUMNS + 4 };

static const struct channel *chosen(const struct value_table *table, unsigned i)
{
	return &table->samples->channels[table->choice->channel[i]];
}

void value_table_init(struct value_table *table, const struct samples *samples,
		      const struct choice *choice, int is_raw)
{
	*table = (struct value_table){ .samples = samples, .choice = choice, .is_raw = is_raw };
}

void value_table_take(struct value_table *table)
{
	struct sample_header header = samples_header(table->samples);

	for (unsigned i = 0; i < table->choice->count; i++) {
		table->is_bad[i] = lines_is_bad(&header, chosen(table, i));
		if (!table->is_bad[i]) {
			table->good_mono_ns[i] = header.wake_mono_ns;
		}
	}
}

static uint64_t raw_of(const struct value_table *table, unsigned i)
{
	return image_get_raw(samples_image(table->samples), chosen(table, i));
}

enum value_state { STATE_GOOD, STATE_OUTSIDE, STATE_BAD };

static const char *const state_name[] = { [STATE_GOOD] = "good",
					  [STATE_OUTSIDE] = "out",
					  [STATE_BAD] = "BAD" };

static enum value_state state_of(const struct value_table *table, unsigned i)
{
	const struct channel *ch = chosen(table, i);

	if (table->is_bad[i]) {
		return STATE_BAD;
	}
	return image_is_outside(ch, image_raw_to_physical(ch, raw_of(table, i))) ? STATE_OUTSIDE
										 : STATE_GOOD;
}

static int name_columns(const struct value_table *table, int columns)
{
	int longest = (int)strlen("channel");
	int room = columns - REST_COLUMNS;

	for (unsigned i = 0; i < table->choice->count; i++) {
		int len = (int)strlen(chosen(table, i)->name);

		longest = len > longest ? len : longest;
	}
	return longest < room ? longest : room < 1 ? 1 : room;
}

struct place {
	const char *name; /* NULL: as given */
	enum value_state state;
	unsigned i;
};

static int compare_places(const void *a, const void *b)
{
	const struct place *x = a;
	const struct place *y = b;

	if (x->state != y->state) {
		return (int)y->state - (int)x->state;
	}
	if (x->name != NULL && strcmp(x->name, y->name) != 0) {
		return strcmp(x->name, y->name);
	}
	return x->i < y->i ? -1 : 1;
}

static void order_of(const struct value_table *table, enum value_table_sort sort,
		     struct place order[CHOOSE_LIMIT])
{
	for (unsigned i = 0; i < table->choice->count; i++) {
		order[i] = (struct place){
			.name = sort == VALUE_TABLE_BY_NAME ? chosen(table, i)->name : NULL,
			.state = sort == VALUE_TABLE_BAD_FIRST ? state_of(table, i) : STATE_GOOD,
			.i = i,
		};
	}
	qsort(order, table->choice->count, sizeof(order[0]), compare_places);
}

static void write_row(const struct value_table *table, unsigned i, int name_width, int64_t mono_ns,
		      FILE *out)
{
	const struct channel *ch = chosen(table, i);
	enum value_state state = state_of(table, i);
	uint64_t raw = raw_of(table, i);
	const char *unit = table->is_raw ? "" : ch->unit;
	size_t unit_len = fit_cut(unit, strlen(unit), UNIT_COLUMNS);
	char unit_text[sizeof(ch->unit) + 1];
	char name[sizeof(ch->name)];
	char value[TEXT_BYTES];
	char short_value[TEXT_BYTES];
	char age[TEXT_BYTES] = "-";

	snprintf(unit_text, sizeof(unit_text), "%.*s", (int)unit_len, unit);
	if (table->is_raw) {
		image_raw_format(ch, raw, value, sizeof(value));
	} else {
		text_value(ch, raw, value);
	}
	if (table->good_mono_ns[i] != 0) {
		snprintf(age, sizeof(age), "%.1f s",
			 (double)(mono_ns - table->good_mono_ns[i]) / 1e9);
	}
	fprintf(out, "%-*s %*s %s%*s %s%-*s%s %*s\n", name_width,
		fit_name(ch->name, name_width, name, sizeof(name)), VALUE_COLUMNS,
		fit_name(value, VALUE_COLUMNS, short_value, sizeof(short_value)), unit_text,
		UNIT_COLUMNS - fit_width(unit_text), "",
		screen_colour(state == STATE_GOOD ? SCREEN_GOOD : SCREEN_BAD), STATE_COLUMNS,
		state_name[state], screen_colour(SCREEN_PLAIN), AGE_COLUMNS, age);
}

void value_table_write_heading(const struct value_table *table, int columns, FILE *out)
{
	fprintf(out, "%s%-*s %*s %-*s %-*s %*s%s\n", screen_colour(SCREEN_BOLD),
		name_columns(table, columns), "channel", VALUE_COLUMNS, "value", UNIT_COLUMNS,
		"unit", STATE_COLUMNS, "", AGE_COLUMNS, "age", screen_colour(SCREEN_PLAIN));
}

void value_table_write(const struct value_table *table, enum value_table_sort sort, int columns,
		       int64_t mono_ns, FILE *out)
{
	struct place order[CHOOSE_LIMIT];
	int name_width = name_columns(table, columns);

	order_of(table, sort, order);
	for (unsigned i = 0; i < table->choice->count; i++) {
		write_row(table, order[i].i, name_width, mono_ns, out);
	}
}
