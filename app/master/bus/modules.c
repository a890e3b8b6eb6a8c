/* SPDX-License-Identifier: MIT */
/*
 * Modules of modular devices (ETG.5001): what the configuration writes to 0xF030 counts, then what
 * the slave has found in its slots (0xF050), then what it was told before (0xF030). Asked are
 * slaves whose ESI description has slots: only that gives the modules a meaning.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/grow.h"
#include "bus/bus_internal.h"
#include "config/sdo_value.h"

enum {
	OBJECT_CONFIGURED = 0xf030,
	OBJECT_DETECTED = 0xf050,
	IDENT_BYTES = 4,
	COMPLETE_FIRST = 2, /* subindex 0 in complete access */
};

/* 1 and the number that the item gives without a type; 0: it is none. */
static int number_in(const struct config *cfg, const struct config_sdo *sdo, uint32_t *ret_ident)
{
	char text[32];
	uint64_t value;

	snprintf(text, sizeof(text), "%.*s", (int)sdo->bytes,
		 (const char *)cfg->octets + sdo->octets);
	if (sdo_value_parse(SDO_UDINT, text, &value) < 0) {
		return 0;
	}
	*ret_ident = (uint32_t)value;
	return 1;
}

/* 1 and the ident that the octets of @sdo have for the slot; 0: they are too few. */
static int octets_in(const struct config *cfg, const struct config_sdo *sdo, unsigned slot,
		     uint32_t *ret_ident)
{
	size_t first = sdo->subindex == 0 ? COMPLETE_FIRST : 0;
	size_t at = sdo->is_complete ? first + (size_t)slot * IDENT_BYTES : 0;

	if (at + IDENT_BYTES > sdo->bytes) {
		return 0;
	}
	*ret_ident = get_le32(cfg->octets + sdo->octets + at);
	return 1;
}

/* 1 and what @sdo writes to the slot; 0: something else. */
static int ident_in(const struct config *cfg, const struct config_sdo *sdo, unsigned slot,
		    uint32_t *ret_ident)
{
	if (!sdo->is_complete && sdo->subindex != slot + 1) {
		return 0;
	}
	if (sdo->type == CONFIG_SDO_OCTETS) {
		return octets_in(cfg, sdo, slot, ret_ident);
	}
	if (sdo->is_complete || sdo->type == CONFIG_SDO_STRING) {
		return 0;
	}
	if (sdo->type == CONFIG_SDO_AUTO) {
		return number_in(cfg, sdo, ret_ident);
	}
	*ret_ident = (uint32_t)sdo->value;
	return 1;
}

static int is_configured(const struct bus *bus, size_t pos, unsigned slot, uint32_t *ret_ident)
{
	int is_there = 0;

	for (size_t i = 0; i < bus->cfg->sdo_count; i++) {
		const struct config_sdo *sdo = &bus->cfg->sdo[i];

		if (sdo->slave_pos == pos && sdo->index == OBJECT_CONFIGURED) {
			is_there |= ident_in(bus->cfg, sdo, slot, ret_ident);
		}
	}
	return is_there;
}

/* 1 and the value; 0: there is no such entry; -errno with a line. */
static int ask(struct bus *bus, size_t pos, uint16_t index, unsigned subindex, uint32_t *ret_value)
{
	uint64_t value;
	uint32_t abort;
	int r = bus_sdo_value(bus, pos, index, (uint8_t)subindex, &value, &abort);

	if (r == -EREMOTEIO) {
		return 0;
	}
	if (r < 0) {
		return bus_fail_slave(
			bus, pos, -EIO, "SDO 0x%04x:%02x of its modules: %s", index, subindex,
			r == -ETIMEDOUT ? "no answer from its mailbox" : strerror(-r));
	}
	*ret_value = (uint32_t)value;
	return 1;
}

static int add(struct bus *bus, size_t pos, unsigned slot, uint32_t ident)
{
	struct bus_module *module;

	if (ident == 0) {
		return 0; /* an empty slot */
	}
	module = array_grow(bus->module, &bus->module_count, sizeof(*module));
	if (module == NULL) {
		return bus_fail(bus, -ENOMEM, "no memory for the modules of the slaves");
	}
	bus->module = module;
	module[bus->module_count - 1] = (struct bus_module){ .slave_pos = (uint16_t)pos,
							     .slot = (uint16_t)slot,
							     .ident = ident };
	return 0;
}

static int read_slave(struct bus *bus, size_t pos)
{
	uint16_t index = OBJECT_DETECTED;
	uint32_t count = 0;
	int r = ask(bus, pos, index, 0, &count);

	if (r == 0) {
		index = OBJECT_CONFIGURED;
		r = ask(bus, pos, index, 0, &count);
	}
	for (unsigned slot = 0; r >= 0 && slot < UINT8_MAX; slot++) {
		uint32_t ident = 0;

		if (!is_configured(bus, pos, slot, &ident) && slot < (count & 0xff)) {
			r = ask(bus, pos, index, slot + 1, &ident);
		}
		r = r < 0 ? r : add(bus, pos, slot, ident);
	}
	return r < 0 ? r : 0;
}

int bus_modules_load(struct bus *bus)
{
	int r = 0;

	free(bus->module);
	bus->module = NULL;
	bus->module_count = 0;
	for (size_t i = 0; i < bus->slave_count && r == 0; i++) {
		const struct esi_device *device = bus_esi_device(bus, i);

		if (device != NULL && device->slot_count > 0 && bus_has_coe(bus, i)) {
			r = read_slave(bus, i);
		}
	}
	if (r < 0 || bus->module_count == 0) {
		return r;
	}
	r = bus_esi_load(bus);
	return r < 0 ? r : bus_startup_plan(bus);
}
