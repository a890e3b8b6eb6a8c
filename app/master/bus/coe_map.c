/* SPDX-License-Identifier: MIT */
/*
 * The mapping as the slave's object dictionary has it: SyncManager types (0x1C00), assigned PDOs
 * (0x1C1n), their entries. An object that is not there means no mapping by CoE; a transfer that
 * fails is an error, never an empty mapping.
 */
#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "bus/bus_internal.h"
#include "wire/coe_unit.h"

enum {
	OBJECT_SM_TYPE = 0x1c00,
	OBJECT_SM_ASSIGN = 0x1c10,
	SM_OUTPUTS = 3,
	SM_INPUTS = 4,
	SM_FIRST = 2,
	SM_COUNT_DEFAULT = 4,
};

struct coe_walk {
	struct bus *bus;
	size_t pos;
	struct pdo_entry *entry;
	size_t capacity;
	size_t count;
};

/* 1 and the value; 0 when the slave aborts (no such object); -EAGAIN (bus_read_ahead()); other
 * -errno with a line. */
static int read_value(struct coe_walk *w, uint16_t index, uint8_t subindex, uint64_t *ret_value)
{
	uint32_t abort;
	int r = bus_sdo_value(w->bus, w->pos, index, subindex, ret_value, &abort);

	if (r == -EREMOTEIO) {
		return 0;
	}
	if (r < 0 && r != -EAGAIN) {
		return bus_fail_slave(
			w->bus, w->pos, -EIO, "SDO 0x%04x:%02x of its mapping: %s", index, subindex,
			r == -ETIMEDOUT ? "no answer from its mailbox" : strerror(-r));
	}
	return r < 0 ? r : 1;
}

static int add_entry(struct coe_walk *w, const struct pdo_entry *common, uint64_t word)
{
	struct pdo_entry *e = &w->entry[w->count];

	if (w->count >= w->capacity) {
		return bus_fail_slave(w->bus, w->pos, -E2BIG,
				      "more mapped entries than PDO_LIMIT (%d)", PDO_LIMIT);
	}
	*e = *common;
	e->index = (uint16_t)(word >> 16);
	e->subindex = (uint8_t)(word >> 8);
	e->bit_len = (uint8_t)word;
	w->count++;
	return 1;
}

static int walk_pdo(struct coe_walk *w, const struct pdo_entry *common)
{
	uint64_t count;
	int is_asked = 0;
	int r = read_value(w, common->pdo, 0, &count);

	for (uint64_t i = 1; r > 0 && i <= (count & 0xff); i++) {
		uint64_t word;
		int one = read_value(w, common->pdo, (uint8_t)i, &word);

		if (one == -EAGAIN) {
			is_asked = 1; /* and all the others at once */
		} else {
			r = one > 0 ? add_entry(w, common, word) : one;
		}
	}
	if (is_asked && r > 0) {
		return -EAGAIN;
	}
	if (r == 0) {
		return bus_fail_slave(
			w->bus, w->pos, -EPROTO,
			"PDO 0x%04x is assigned to SM%u, but its mapping cannot be read",
			common->pdo, common->sm);
	}
	return r;
}

static int walk_sm(struct coe_walk *w, uint8_t sm, uint8_t type)
{
	uint16_t assign = (uint16_t)(OBJECT_SM_ASSIGN + sm);
	uint64_t count;
	int r = read_value(w, assign, 0, &count);

	if (r <= 0) {
		return r;
	}
	for (uint64_t i = 1; i <= (count & 0xff); i++) {
		struct pdo_entry common = { .sm = sm, .is_output = type == SM_OUTPUTS };
		uint64_t pdo;

		r = read_value(w, assign, (uint8_t)i, &pdo);
		if (r == 0) {
			return bus_fail_slave(w->bus, w->pos, -EPROTO, "0x%04x:%02x cannot be read",
					      assign, (unsigned)i);
		}
		if (r < 0) {
			return r;
		}
		common.pdo = (uint16_t)pdo;
		if (common.pdo != 0) {
			r = walk_pdo(w, &common);
		}
		if (r < 0) {
			return r;
		}
	}
	return 0;
}

int bus_coe_entries(struct bus *bus, size_t pos, struct pdo_entry *ret, size_t capacity)
{
	struct coe_walk w = { .bus = bus, .pos = pos, .entry = ret, .capacity = capacity };
	uint64_t sm_count = SM_COUNT_DEFAULT;
	int has_types = read_value(&w, OBJECT_SM_TYPE, 0, &sm_count);

	if (has_types < 0) {
		return has_types;
	}
	if (sm_count > EC_MAXSM) {
		sm_count = EC_MAXSM;
	}
	for (uint8_t sm = SM_FIRST; sm < sm_count; sm++) {
		uint64_t type = sm == SM_FIRST ? SM_OUTPUTS : sm == SM_FIRST + 1 ? SM_INPUTS : 0;
		int r = 0;

		if (has_types > 0) {
			r = read_value(&w, OBJECT_SM_TYPE, (uint8_t)(sm + 1), &type);
		}
		if (r >= 0 && (type == SM_OUTPUTS || type == SM_INPUTS)) {
			r = walk_sm(&w, sm, (uint8_t)type);
		}
		if (r < 0) {
			return r;
		}
	}
	return (int)w.count;
}

static_assert((int)COE_UNIT_BYTES == (int)LIMIT_UNIT_BYTES, "a unit fits");

enum { UNIT_BITS_MIN = 8 };

/* Bits have no unit: status bits of a terminal are not asked for one by one. */
static int may_have_unit(const struct pdo_entry *e)
{
	return e->bit_len >= UNIT_BITS_MIN;
}

static void complete(struct pdo_entry *e, const struct coe_entry *found)
{
	if (e->data_type == 0) {
		e->data_type = found->data_type;
	}
	if (e->name[0] == '\0') {
		snprintf(e->name, sizeof(e->name), "%.*s", PDO_NAME_BYTES - 1, found->name);
	}
	coe_unit_format(found->unit, e->unit);
}

int bus_coe_names(struct bus *bus, size_t pos, struct pdo_entry *entry, size_t count)
{
	int has_answered = 0;
	int result = 0;

	if ((bus->soem_slave[soem_index(pos)].CoEdetails & ECT_COEDET_SDOINFO) == 0) {
		return 0;
	}
	for (size_t i = 0; i < count; i++) {
		struct pdo_entry *e = &entry[i];
		struct coe_entry found;
		int r;

		if (e->index == 0 ||
		    (e->name[0] != '\0' && e->data_type != 0 && !may_have_unit(e))) {
			continue;
		}
		r = bus_sdo_entry(bus, pos, e->index, e->subindex, &found);
		if (r == -EAGAIN && !has_answered) {
			return r; /* the others when it is known to answer */
		}
		if (r < 0 && r != -EAGAIN && r != -EREMOTEIO) {
			return result;
		}
		has_answered = 1;
		if (r == -EAGAIN) {
			result = r;
		} else if (r == 0) {
			complete(e, &found);
		}
	}
	return result;
}
