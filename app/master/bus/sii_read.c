/* SPDX-License-Identifier: MIT */
/* SII images out of the slaves, through SOEM's EEPROM access and cache; each type of slave is read
 * once. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"

static int is_same_device(const struct slave_info *a, const struct slave_info *b)
{
	return a->vendor == b->vendor && a->product == b->product && a->revision == b->revision;
}

static void copy_bytes(struct bus *bus, size_t pos, uint8_t *image, size_t from, size_t count)
{
	for (size_t i = from; i < from + count && i < SII_IMAGE_BYTES; i++) {
		image[i] = ecx_siigetbyte(&bus->context, soem_index(pos), (uint16_t)i);
	}
}

static int is_needed(uint16_t category)
{
	return category == SII_CATEGORY_STRINGS || category == SII_CATEGORY_GENERAL ||
	       category == SII_CATEGORY_TXPDO || category == SII_CATEGORY_RXPDO ||
	       category == SII_CATEGORY_DC;
}

/* Walk the categories; the length found is that of the image, as far as it can be followed. */
static size_t read_categories(struct bus *bus, size_t pos, uint8_t *image)
{
	size_t at = SII_CATEGORIES_BYTE;

	while (at + 4 <= SII_IMAGE_BYTES) {
		uint16_t category;
		size_t len;

		copy_bytes(bus, pos, image, at, 4);
		category = get_le16(image + at);
		len = 2u * (size_t)get_le16(image + at + 2);
		if (category == SII_CATEGORY_END) {
			return at + 4;
		}
		if (is_needed(category)) {
			copy_bytes(bus, pos, image, at + 4, len);
		}
		at += 4 + len;
	}
	return SII_IMAGE_BYTES;
}

int bus_sii_load(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];

	for (size_t i = 0; i < pos; i++) {
		const struct bus_slave *other = &bus->slave[i];

		if (other->sii != NULL && is_same_device(&other->info, &sl->info)) {
			sl->sii = other->sii;
			sl->sii_len = other->sii_len;
			return 0;
		}
	}
	memset(bus->sii[pos], 0, SII_IMAGE_BYTES);
	sl->sii_len = read_categories(bus, pos, bus->sii[pos]);
	sl->sii = bus->sii[pos];
	/* The mailbox of some slaves needs the EEPROM on its own side. */
	return ecx_eeprom2pdi(&bus->context, soem_index(pos)) > 0 ? 0 : -EIO;
}

static void copy_string(const struct bus_slave *sl, uint8_t number, char ret_name[PDO_NAME_BYTES])
{
	char text[SII_NAME_BYTES];

	sii_text(sl->sii, sl->sii_len, number, text);
	snprintf(ret_name, PDO_NAME_BYTES, "%.31s", text);
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
