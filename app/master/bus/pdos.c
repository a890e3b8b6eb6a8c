/* SPDX-License-Identifier: MIT */
/*
 * slaves[].pdos[]: which PDOs are assigned, and what configurable ones map. What is listed is
 * checked against the slave's dictionary, its SII and its ESI description, and becomes start-up
 * SDOs of PS: counts to 0, mappings, assignments. A slave that comes back gets them again.
 */
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/utf8.h"
#include "bus/bus_internal.h"

enum {
	OBJECT_SM_ASSIGN = 0x1c10,
	FIRST_TX = 0x1a00,
	SM_TYPE_OUTPUTS = 3,
	SM_TYPE_INPUTS = 4,
	CHOSEN_MAX = 128,
	LIST_BYTES = 140,
	ACCESS_RX_MAPPABLE = 0x40,
	ACCESS_TX_MAPPABLE = 0x80,
};

struct chosen {
	const struct config_pdo *item;
	uint16_t index;
	uint8_t is_tx;
	uint8_t sm;
};

/* One slave. */
struct choice {
	struct bus *bus;
	size_t pos;
	const struct esi_device *device; /* NULL */
	struct chosen pdo[CHOSEN_MAX];
	size_t count;
};

__attribute__((format(printf, 3, 4))) static int
refuse(const struct choice *c, const struct config_pdo *item, const char *format, ...)
{
	char why[LIST_BYTES + 96];
	va_list args;

	va_start(args, format);
	vsnprintf(why, sizeof(why), format, args);
	va_end(args);
	return bus_fail_slave(c->bus, c->pos, -EINVAL, "PDO %s (%s:%d): %s", item->pdo,
			      c->bus->cfg->path, item->line, why);
}

/* --- which PDOs there are --- */

static const struct sii_pdo *sii_pdo_of(const struct choice *c, uint16_t index)
{
	const struct sii *sii = &c->bus->parsed;

	for (size_t i = 0; i < sii->pdo_count; i++) {
		if (sii->pdo[i].index == index) {
			return &sii->pdo[i];
		}
	}
	return NULL;
}

static void sii_name(const struct choice *c, const struct sii_pdo *pdo,
		     char ret_name[SII_NAME_BYTES])
{
	const struct bus_slave *sl = &c->bus->slave[c->pos];

	sii_text(sl->sii, sl->sii_len, pdo->name, ret_name);
}

/* Those called @name: how many, and the index of the first. */
static unsigned find_named(const struct choice *c, const char *name, uint16_t *ret_index)
{
	const struct sii *sii = &c->bus->parsed;
	unsigned found = 0;

	for (size_t i = 0; c->device != NULL && i < c->device->pdo_count; i++) {
		if (strcmp(c->device->pdo[i].name, name) == 0) {
			*ret_index = found++ == 0 ? c->device->pdo[i].index : *ret_index;
		}
	}
	for (size_t i = 0; found == 0 && i < sii->pdo_count; i++) {
		char text[SII_NAME_BYTES];

		sii_name(c, &sii->pdo[i], text);
		if (strcmp(text, name) == 0) {
			*ret_index = sii->pdo[i].index;
			found = 1;
			for (size_t k = i + 1; k < sii->pdo_count; k++) {
				sii_name(c, &sii->pdo[k], text);
				found += strcmp(text, name) == 0;
			}
		}
	}
	return found;
}

/* Names of the PDOs of the SII, or of the ESI description, as far as they fit. */
static void list_names(const struct choice *c, char *buf, size_t bytes)
{
	const struct sii *sii = &c->bus->parsed;
	size_t count = c->device != NULL ? c->device->pdo_count : sii->pdo_count;
	size_t len = 0;

	snprintf(buf, bytes, "none");
	for (size_t i = 0; i < count; i++) {
		char name[SII_NAME_BYTES];

		if (c->device != NULL) {
			utf8_copy(c->device->pdo[i].name, name, sizeof(name));
		} else {
			sii_name(c, &sii->pdo[i], name);
		}
		if (len + strlen(name) + sizeof(", ...") > bytes) {
			snprintf(buf + len, bytes - len, ", ...");
			return;
		}
		len += (size_t)snprintf(buf + len, bytes - len, "%s%s", len > 0 ? ", " : "", name);
	}
}

static uint8_t sm_of(const struct choice *c, uint16_t index, int is_tx)
{
	const struct sii *sii = &c->bus->parsed;
	const struct sii_pdo *pdo = sii_pdo_of(c, index);
	const struct esi_pdo *esi = c->device == NULL ? NULL : esi_find_pdo(c->device, index);

	if (pdo != NULL && pdo->sm < sii->sm_count) {
		return pdo->sm;
	}
	if (esi != NULL && esi->sm != ESI_NO_SM) {
		return (uint8_t)esi->sm;
	}
	for (size_t n = 0; n < sii->sm_count; n++) {
		if (sii->sm[n].type == (is_tx ? SM_TYPE_INPUTS : SM_TYPE_OUTPUTS)) {
			return (uint8_t)n;
		}
	}
	return is_tx ? 3 : 2;
}

/* 0: it is in the slave's dictionary. */
static int check_exists(const struct choice *c, const struct config_pdo *item, uint16_t index)
{
	uint64_t count;
	uint32_t abort;
	int r = bus_sdo_value(c->bus, c->pos, index, 0, &count, &abort);

	if (r == -EREMOTEIO) {
		return refuse(c, item, "0x%04x does not exist in its object dictionary", index);
	}
	return r < 0 ? refuse(c, item, "0x%04x cannot be read: %s", index, strerror(-r)) : 0;
}

static int choose(struct choice *c, const struct config_pdo *item)
{
	uint16_t index = item->index;
	char names[LIST_BYTES];
	int r;

	if (c->count == CHOSEN_MAX) {
		return refuse(c, item, "more than %d PDOs of one slave", CHOSEN_MAX);
	}
	if (index == 0) {
		unsigned found = find_named(c, item->pdo, &index);

		if (found == 0) {
			list_names(c, names, sizeof(names));
			return refuse(c, item, "it has no PDO of this name; it has: %s", names);
		}
		if (found > 1) {
			return refuse(c, item, "%u of its PDOs have this name: give the index",
				      found);
		}
	}
	for (size_t i = 0; i < c->count; i++) {
		if (c->pdo[i].index == index) {
			return refuse(c, item, "is already listed in line %d",
				      c->pdo[i].item->line);
		}
	}
	r = check_exists(c, item, index);
	if (r < 0) {
		return r;
	}
	c->pdo[c->count] = (struct chosen){ .item = item,
					    .index = index,
					    .is_tx = index >= FIRST_TX,
					    .sm = sm_of(c, index, index >= FIRST_TX) };
	c->count++;
	return 0;
}

/* --- what the vendor allows --- */

static int has_chosen(const struct choice *c, uint16_t index)
{
	for (size_t i = 0; i < c->count; i++) {
		if (c->pdo[i].index == index) {
			return 1;
		}
	}
	return 0;
}

static int check_excludes(const struct choice *c, const struct chosen *one)
{
	const struct esi_pdo *esi = esi_find_pdo(c->device, one->index);

	for (size_t k = 0; esi != NULL && k < esi->exclude_count; k++) {
		if (has_chosen(c, esi->exclude[k])) {
			return refuse(c, one->item,
				      "cannot be assigned together with 0x%04x (ESI: Exclude)",
				      esi->exclude[k]);
		}
	}
	return 0;
}

static int check_mandatory(const struct choice *c)
{
	for (size_t i = 0; i < c->device->pdo_count; i++) {
		const struct esi_pdo *esi = &c->device->pdo[i];

		for (size_t k = 0; k < c->count && esi->is_mandatory; k++) {
			if (c->pdo[k].is_tx == esi->is_tx && !has_chosen(c, esi->index)) {
				return refuse(
					c, c->pdo[k].item,
					"0x%04x is mandatory, and not listed (ESI: Mandatory)",
					esi->index);
			}
		}
	}
	return 0;
}

static int check_entry(const struct choice *c, const struct chosen *one, uint32_t word)
{
	uint16_t index = (uint16_t)(word >> 16);
	uint8_t subindex = (uint8_t)(word >> 8);
	unsigned bits = word & 0xff;
	const struct esi_entry *esi;
	struct coe_entry found;
	int has_info =
		(c->bus->soem_slave[soem_index(c->pos)].CoEdetails & ECT_COEDET_SDOINFO) != 0;

	if (index == 0) {
		return 0;
	}
	if (has_info) {
		int r = bus_sdo_entry(c->bus, c->pos, index, subindex, &found);
		unsigned may = one->is_tx ? ACCESS_TX_MAPPABLE : ACCESS_RX_MAPPABLE;

		if (r < 0) {
			return refuse(c, one->item, "0x%04x:%02x does not exist in its dictionary",
				      index, subindex);
		}
		if (found.bit_len != bits) {
			return refuse(c, one->item, "0x%04x:%02x has %u bits, not %u", index,
				      subindex, found.bit_len, bits);
		}
		return (found.access & may) == 0
			       ? refuse(c, one->item, "0x%04x:%02x cannot be mapped to %s", index,
					subindex, one->is_tx ? "a TxPDO" : "an RxPDO")
			       : 0;
	}
	esi = c->device == NULL ? NULL : esi_find_entry(c->device, one->index, index, subindex);
	return esi != NULL && esi->bits != bits
		       ? refuse(c, one->item, "0x%04x:%02x has %u bits (ESI), not %u", index,
				subindex, esi->bits, bits)
		       : 0;
}

static int check_entries(const struct choice *c, const struct chosen *one)
{
	const ec_slavet *soem = &c->bus->soem_slave[soem_index(c->pos)];
	const struct esi_pdo *esi = c->device == NULL ? NULL : esi_find_pdo(c->device, one->index);
	int r = 0;

	if (one->item->entry_count == 0) {
		return 0;
	}
	if ((esi != NULL && esi->is_fixed) || (soem->CoEdetails & ECT_COEDET_PDOCONFIG) == 0) {
		return refuse(c, one->item, "its mapping is fixed (%s)",
			      esi != NULL && esi->is_fixed ? "ESI: Fixed"
							   : "SII: no PDO configuration");
	}
	for (unsigned i = 0; i < one->item->entry_count && r == 0; i++) {
		r = check_entry(c, one, c->bus->cfg->pdo_entry[one->item->entry_first + i]);
	}
	return r;
}

/* --- what is written --- */

/* NOLINTNEXTLINE(readability-function-size): an SDO has so many parts */
static void put(struct choice *c, const struct config_pdo *item, uint16_t index, uint8_t subindex,
		unsigned bytes, uint32_t value)
{
	c->bus->assign[c->bus->assign_count++] =
		(struct startup_command){ .slave_pos = (uint16_t)c->pos,
					  .transition = CONFIG_TRANSITION_PS,
					  .origin = STARTUP_OF_PDOS,
					  .index = index,
					  .subindex = subindex,
					  .type = CONFIG_SDO_OCTETS, /* its type is known */
					  .len = (uint16_t)bytes,
					  .value = value,
					  .pdo = item->pdo,
					  .line = item->line };
}

static void put_mapping(struct choice *c, const struct chosen *one)
{
	const struct config_pdo *item = one->item;

	put(c, item, one->index, 0, 1, 0);
	for (uint16_t i = 0; i < item->entry_count; i++) {
		put(c, item, one->index, (uint8_t)(i + 1), 4,
		    c->bus->cfg->pdo_entry[item->entry_first + i]);
	}
	put(c, item, one->index, 0, 1, item->entry_count);
}

static void put_assignment(struct choice *c, uint8_t sm)
{
	const struct chosen *last = NULL;
	uint8_t count = 0;

	for (size_t i = 0; i < c->count; i++) {
		if (c->pdo[i].sm == sm) {
			last = &c->pdo[i];
			put(c, last->item, (uint16_t)(OBJECT_SM_ASSIGN + sm), ++count, 2,
			    last->index);
		}
	}
	if (last != NULL) {
		put(c, last->item, (uint16_t)(OBJECT_SM_ASSIGN + sm), 0, 1, count);
	}
}

static void put_all(struct choice *c)
{
	for (uint8_t sm = 0; sm < EC_MAXSM; sm++) {
		for (size_t i = 0; i < c->count; i++) {
			if (c->pdo[i].sm == sm) {
				put(c, c->pdo[i].item, (uint16_t)(OBJECT_SM_ASSIGN + sm), 0, 1, 0);
				break;
			}
		}
	}
	for (size_t i = 0; i < c->count; i++) {
		if (c->pdo[i].item->entry_count > 0) {
			put_mapping(c, &c->pdo[i]);
		}
	}
	for (uint8_t sm = 0; sm < EC_MAXSM; sm++) {
		put_assignment(c, sm);
	}
}

/* A slave whose assignment is fixed: it must be what is listed. */
static int check_fixed(const struct choice *c)
{
	for (uint8_t sm = 0; sm < EC_MAXSM; sm++) {
		const struct config_pdo *item = NULL;
		uint64_t wanted = 0;
		uint64_t count = 0;
		uint32_t abort;
		int is_same = 1;

		for (size_t i = 0; i < c->count; i++) {
			uint64_t now = 0;

			if (c->pdo[i].sm != sm) {
				continue;
			}
			item = c->pdo[i].item;
			is_same &= bus_sdo_value(c->bus, c->pos, (uint16_t)(OBJECT_SM_ASSIGN + sm),
						 (uint8_t)++wanted, &now, &abort) == 0 &&
				   now == c->pdo[i].index;
		}
		if (item != NULL &&
		    (!is_same ||
		     bus_sdo_value(c->bus, c->pos, (uint16_t)(OBJECT_SM_ASSIGN + sm), 0, &count,
				   &abort) < 0 ||
		     count != wanted)) {
			return refuse(
				c, item,
				"the slave's assignment to SM%u is fixed, and another one (SII: "
				"no PDO assignment; ecdaq pdo)",
				sm);
		}
	}
	return 0;
}

/* --- a slave --- */

static int check_all(const struct choice *c)
{
	int r = c->device == NULL ? 0 : check_mandatory(c);

	for (size_t i = 0; i < c->count && r == 0; i++) {
		if (c->device != NULL) {
			r = check_excludes(c, &c->pdo[i]);
		}
		r = r < 0 ? r : check_entries(c, &c->pdo[i]);
	}
	return r;
}

static int plan_slave(struct bus *bus, size_t pos, const struct config_pdo *first)
{
	static struct choice c; /* service thread */
	const struct bus_slave *sl = &bus->slave[pos];
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	char why[128];
	int r = 0;

	c = (struct choice){ .bus = bus, .pos = pos, .device = bus_esi_device(bus, pos) };
	if (!bus_has_coe(bus, pos)) {
		return refuse(&c, first, "the slave has no CoE mailbox: its PDOs are fixed");
	}
	if (sii_parse(sl->sii, sl->sii_len, &bus->parsed, why, sizeof(why)) < 0) {
		return bus_fail_slave(bus, pos, -EPROTO, "%s", why);
	}
	for (size_t i = 0; i < bus->cfg->pdo_count && r == 0; i++) {
		if (bus->cfg->pdo[i].slave_pos == pos) {
			r = choose(&c, &bus->cfg->pdo[i]);
		}
	}
	r = r < 0 ? r : check_all(&c);
	if (r < 0) {
		return r;
	}
	if ((soem->CoEdetails & ECT_COEDET_PDOASSIGN) == 0) {
		return check_fixed(&c);
	}
	put_all(&c);
	return 0;
}

/* A PDO: its assignment; of each SM twice the count; of a mapping the entries and the count. */
static size_t room_of(const struct bus *bus)
{
	return bus->cfg->pdo_count * 3 + bus->slave_count * 2 * EC_MAXSM +
	       bus->cfg->pdo_entry_count;
}

static const struct config_pdo *first_of(const struct bus *bus, size_t pos)
{
	for (size_t i = 0; i < bus->cfg->pdo_count; i++) {
		if (bus->cfg->pdo[i].slave_pos == pos) {
			return &bus->cfg->pdo[i];
		}
	}
	return NULL;
}

int bus_pdos_plan(struct bus *bus, size_t from, size_t end)
{
	int r = 0;

	free(bus->assign);
	bus->assign_count = 0;
	bus->assign = calloc(room_of(bus) + 1, sizeof(bus->assign[0]));
	if (bus->assign == NULL) {
		return bus_fail(bus, -ENOMEM, "no memory for the assignment of PDOs");
	}
	for (size_t pos = from; pos < end && r == 0; pos++) {
		const struct config_pdo *first = first_of(bus, pos);

		r = first == NULL ? 0 : plan_slave(bus, pos, first);
	}
	return r < 0 ? r : bus_startup_plan(bus);
}
