/* SPDX-License-Identifier: MIT */
/* The process data that a slave's SII describes. */
#include <errno.h>
#include <stdio.h>

#include "bus/bus_internal.h"

static void copy_string(const struct bus_slave *sl, uint8_t number, char ret_name[PDO_NAME_BYTES])
{
	char text[SII_NAME_BYTES];

	sii_text(sl->sii, sl->sii_len, number, text);
	snprintf(ret_name, PDO_NAME_BYTES, "%.*s", PDO_NAME_BYTES - 1, text);
}

/* The entries of one direction's PDOs that have a SyncManager. Returns the new count or -E2BIG. */
static int add_direction(const struct bus *bus, size_t pos, int is_output, struct pdo_entry *ret,
			 size_t count, size_t capacity)
{
	const struct bus_slave *sl = &bus->slave[pos];
	const struct sii *sii = &bus->parsed;

	for (size_t i = 0; i < sii->pdo_count; i++) {
		const struct sii_pdo *pdo = &sii->pdo[i];

		if (pdo->is_tx == is_output || pdo->sm >= EC_MAXSM) {
			continue;
		}
		for (size_t k = 0; k < pdo->entry_count; k++) {
			const struct sii_entry *from = &sii->entry[pdo->first_entry + k];
			struct pdo_entry *e = &ret[count];

			if (count >= capacity) {
				return -E2BIG;
			}
			*e = (struct pdo_entry){ .pdo = pdo->index,
						 .index = from->index,
						 .subindex = from->subindex,
						 .sm = pdo->sm,
						 .bit_len = from->bit_len,
						 .is_output = (uint8_t)is_output,
						 .data_type = from->data_type };
			copy_string(sl, from->name, e->name);
			copy_string(sl, pdo->name, e->pdo_name);
			count++;
		}
	}
	return (int)count;
}

void bus_sii_complete(const struct bus *bus, size_t pos, struct pdo_entry *e)
{
	const struct bus_slave *sl = &bus->slave[pos];
	const struct sii *sii = &bus->parsed;

	for (size_t i = 0; i < sii->pdo_count; i++) {
		if (sii->pdo[i].index == e->pdo) {
			copy_string(sl, sii->pdo[i].name, e->pdo_name);
			break;
		}
	}
	for (size_t i = 0; i < sii->entry_count && e->name[0] == '\0'; i++) {
		if (sii->entry[i].index == e->index && sii->entry[i].subindex == e->subindex) {
			copy_string(sl, sii->entry[i].name, e->name);
			e->data_type = sii->entry[i].data_type;
		}
	}
}

int bus_sii_entries(struct bus *bus, size_t pos, struct pdo_entry *ret, size_t capacity)
{
	const struct bus_slave *sl = &bus->slave[pos];
	char why[128];
	int count;

	if (sii_parse(sl->sii, sl->sii_len, &bus->parsed, why, sizeof(why)) < 0) {
		return bus_fail_slave(bus, pos, -EPROTO, "%s", why);
	}
	count = add_direction(bus, pos, 1, ret, 0, capacity);
	if (count >= 0) {
		count = add_direction(bus, pos, 0, ret, (size_t)count, capacity);
	}
	return count >= 0 ? count
			  : bus_fail_slave(bus, pos, -E2BIG,
					   "more mapped entries than PDO_LIMIT (%d)", PDO_LIMIT);
}
