/* SPDX-License-Identifier: MIT */
/* slaves[].pdos[] against the PDOs that a slave has assigned. */
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "bus/channels.h"
#include "bus/differences.h"
#include "bus/pdo.h"

enum { FIRST_TX = 0x1a00 };

/* One slave. */
struct comparison {
	const struct config *cfg;
	const struct slave_info *slave;
	const struct pdo_entry *entry; /* mapped, PDO by PDO */
	size_t count;
};

static int is_of(const struct config_pdo *item, const struct pdo_entry *e)
{
	return item->index != 0 ? item->index == e->pdo : strcmp(item->pdo, e->pdo_name) == 0;
}

/* Is @item of this direction? A name that is not assigned is shown once, with the inputs. */
static int is_direction(const struct comparison *c, const struct config_pdo *item, int is_output)
{
	if (item->index != 0) {
		return (item->index < FIRST_TX) == is_output;
	}
	for (size_t i = 0; i < c->count; i++) {
		if (is_of(item, &c->entry[i])) {
			return c->entry[i].is_output == is_output;
		}
	}
	return !is_output;
}

/* The next item of this slave and direction at or behind @item; NULL. */
static const struct config_pdo *next_item(const struct comparison *c, const struct config_pdo *item,
					  int is_output)
{
	for (; item < &c->cfg->pdo[c->cfg->pdo_count]; item++) {
		if (item->slave_pos == c->slave->slave_pos && is_direction(c, item, is_output)) {
			return item;
		}
	}
	return NULL;
}

/* The first entry of the next PDO of this direction at or behind @i; the count: no more. */
static size_t next_pdo(const struct comparison *c, size_t i, int is_output)
{
	while (i < c->count && (c->entry[i].is_output != is_output ||
				(i > 0 && c->entry[i].pdo == c->entry[i - 1].pdo &&
				 c->entry[i].sm == c->entry[i - 1].sm))) {
		i++;
	}
	return i;
}

/* What @item maps is what the PDO maps whose first entry is @first. */
static int has_entries(const struct comparison *c, const struct config_pdo *item, size_t first)
{
	for (size_t i = 0; i < item->entry_count; i++) {
		const struct pdo_entry *e = &c->entry[first + i];

		if (first + i >= c->count || e->pdo != c->entry[first].pdo ||
		    c->cfg->pdo_entry[item->entry_first + i] !=
			    ((uint32_t)e->index << 16 | (uint32_t)e->subindex << 8 | e->bit_len)) {
			return 0;
		}
	}
	return item->entry_count == 0 || first + item->entry_count >= c->count ||
	       c->entry[first + item->entry_count].pdo != c->entry[first].pdo;
}

/* The first entry of what is assigned for @item; the count: it is not. */
static size_t find(const struct comparison *c, const struct config_pdo *item, int is_output)
{
	size_t i = next_pdo(c, 0, is_output);

	while (i < c->count && !is_of(item, &c->entry[i])) {
		i = next_pdo(c, i + 1, is_output);
	}
	return i;
}

/* All that is listed is assigned, in this order in each SyncManager, as it is mapped, and nothing
 * else. */
static int is_same(const struct comparison *c, const struct config_pdo *first, int is_output)
{
	size_t last_of[CHANNELS_SM] = { 0 };
	size_t assigned = 0;
	size_t listed = 0;

	for (size_t i = next_pdo(c, 0, is_output); i < c->count;
	     i = next_pdo(c, i + 1, is_output)) {
		assigned++;
	}
	for (const struct config_pdo *item = first; item != NULL;
	     item = next_item(c, item + 1, is_output)) {
		size_t at = find(c, item, is_output);

		if (at == c->count || !has_entries(c, item, at) ||
		    at < last_of[c->entry[at].sm % CHANNELS_SM]) {
			return 0;
		}
		last_of[c->entry[at].sm % CHANNELS_SM] = at;
		listed++;
	}
	return listed == assigned;
}

__attribute__((format(printf, 3, 4))) static void append(char *text, size_t bytes,
							 const char *format, ...)
{
	size_t len = strlen(text);
	va_list args;

	va_start(args, format);
	vsnprintf(text + len, bytes - len, format, args);
	va_end(args);
}

static int add_difference(const struct comparison *c, const struct config_pdo *first, int is_output,
			  struct differences *list)
{
	struct difference *diff = differences_add(list, DIFFERENCE_PDOS);

	if (diff == NULL) {
		return -ENOMEM;
	}
	diff->position = c->slave->slave_pos;
	diff->item = c->slave->config_item > 0 ? (uint16_t)(c->slave->config_item - 1)
					       : DIFFERENCE_NOWHERE;
	diff->line = (uint32_t)first->line;
	snprintf(diff->name, sizeof(diff->name), "%.*s", (int)sizeof(c->slave->name),
		 c->slave->name);
	snprintf(diff->group, sizeof(diff->group), "%s", c->cfg->slave[c->slave->slave_pos].group);
	snprintf(diff->property, sizeof(diff->property), "PDOs");
	for (const struct config_pdo *item = first; item != NULL;
	     item = next_item(c, item + 1, is_output)) {
		size_t at = find(c, item, is_output);

		append(diff->expected, sizeof(diff->expected), "%s%s%s", item == first ? "" : ", ",
		       item->pdo,
		       at < c->count && !has_entries(c, item, at) ? " with other entries" : "");
	}
	for (size_t i = next_pdo(c, 0, is_output); i < c->count;
	     i = next_pdo(c, i + 1, is_output)) {
		append(diff->found, sizeof(diff->found), "%s0x%04x",
		       diff->found[0] == '\0' ? "" : ", ", c->entry[i].pdo);
	}
	if (diff->found[0] == '\0') {
		snprintf(diff->found, sizeof(diff->found), "none with entries");
	}
	return 0;
}

int differences_of_pdos(const struct config *cfg, const struct slave_info *slave,
			const struct pdo_entry *entry, size_t count, struct differences *list)
{
	const struct comparison c = { cfg, slave, entry, count };
	int r = 0;

	for (int is_output = 1; is_output >= 0 && r == 0; is_output--) {
		const struct config_pdo *first = next_item(&c, cfg->pdo, is_output);

		if (first != NULL && !is_same(&c, first, is_output)) {
			r = add_difference(&c, first, is_output, list);
		}
	}
	return r;
}
