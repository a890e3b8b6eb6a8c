/* SPDX-License-Identifier: MIT */
/* Which start-up SDOs each slave gets, and in which order. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "config/sdo_value.h"

static void add(struct bus *bus, struct startup_command command)
{
	bus->startup[bus->startup_count++] = command;
}

static void add_mode(struct bus *bus, size_t pos)
{
	const struct config_slave *want = bus_config_slave(bus, pos);

	if (bus->slave[pos].mode == CONFIG_MODE_UNSET) {
		return;
	}
	add(bus, (struct startup_command){
			 .slave_pos = (uint16_t)pos,
			 .transition = CONFIG_TRANSITION_PS,
			 .origin = STARTUP_OF_MODE,
			 .index = PICCOLO_OBJECT_MODE,
			 .subindex = PICCOLO_SUBINDEX_MODE,
			 .type = SDO_USINT,
			 .len = 1,
			 .value = bus->slave[pos].mode == CONFIG_MODE_ONESHOT ? 1 : 0,
			 .line = want != NULL ? want->line : 0,
		 });
}

static void add_configured(struct bus *bus, size_t pos)
{
	const struct config *cfg = bus->cfg;

	for (size_t i = 0; i < cfg->sdo_count; i++) {
		const struct config_sdo *sdo = &cfg->sdo[i];
		int is_octets = sdo->type >= CONFIG_SDO_STRING;

		if (sdo->slave_pos != pos) {
			continue;
		}
		add(bus, (struct startup_command){
				 .slave_pos = (uint16_t)pos,
				 .transition = sdo->transition,
				 .origin = STARTUP_OF_CONFIG,
				 .index = sdo->index,
				 .subindex = sdo->subindex,
				 .is_complete = sdo->is_complete,
				 .type = sdo->type,
				 .len = sdo->bytes,
				 .value = sdo->value,
				 .octets = is_octets ? cfg->octets + sdo->octets : NULL,
				 .untyped = sdo->type == CONFIG_SDO_AUTO ? cfg->octets + sdo->octets
									 : NULL,
				 .line = sdo->line,
			 });
	}
}

static void add_assignment(struct bus *bus, size_t pos)
{
	for (size_t i = 0; i < bus->assign_count; i++) {
		if (bus->assign[i].slave_pos == pos) {
			add(bus, bus->assign[i]);
		}
	}
}

/* Does the configuration write the object itself: by slaves[].sdo[] in the same transition, or by
 * slaves[].pdos[]? */
static int is_replaced(const struct bus *bus, const struct startup_command *command)
{
	for (size_t i = 0; i < bus->cfg->sdo_count; i++) {
		const struct config_sdo *sdo = &bus->cfg->sdo[i];

		if (sdo->slave_pos == command->slave_pos && sdo->index == command->index &&
		    sdo->subindex == command->subindex && sdo->transition == command->transition) {
			return 1;
		}
	}
	for (size_t i = 0; i < bus->assign_count; i++) {
		if (bus->assign[i].slave_pos == command->slave_pos &&
		    bus->assign[i].index == command->index) {
			return 1;
		}
	}
	return 0;
}

/* <InitCmd> of the vendor's description of a device, or of a module whose objects that depend on
 * the slot are @shift further up; in its order. */
static void add_commands(struct bus *bus, size_t pos, const struct esi_device *device,
			 unsigned shift)
{
	static const uint8_t bit_of[CONFIG_TRANSITIONS] = {
		[CONFIG_TRANSITION_IP] = ESI_TRANSITION_IP,
		[CONFIG_TRANSITION_PS] = ESI_TRANSITION_PS,
		[CONFIG_TRANSITION_SO] = ESI_TRANSITION_SO,
		[CONFIG_TRANSITION_OS] = ESI_TRANSITION_OS,
	};

	for (size_t i = 0; device != NULL && i < device->command_count; i++) {
		const struct esi_command *from = &device->command[i];

		for (int t = 0; t < CONFIG_TRANSITIONS; t++) {
			const struct startup_command command = {
				.slave_pos = (uint16_t)pos,
				.transition = (enum config_transition)t,
				.origin = STARTUP_OF_ESI,
				.index = (uint16_t)(from->index +
						    (from->depends_on_slot ? shift : 0)),
				.subindex = from->subindex,
				.is_complete = from->is_complete_access,
				.type = CONFIG_SDO_OCTETS,
				.len = from->len,
				.octets = from->data,
			};

			if ((from->transitions & bit_of[t]) != 0 && from->len > 0 &&
			    !is_replaced(bus, &command)) {
				add(bus, command);
			}
		}
	}
}

static void add_described(struct bus *bus, size_t pos)
{
	add_commands(bus, pos, bus_esi_device(bus, pos), 0);
	for (size_t i = 0; i < bus->module_count; i++) {
		const struct bus_module *module = &bus->module[i];

		if (module->slave_pos == pos) {
			const struct esi_slot *slot;
			const struct esi_device *device = bus_esi_module(bus, module, &slot);

			add_commands(bus, pos, device,
				     device == NULL
					     ? 0u
					     : (unsigned)slot->index_increment * module->slot);
		}
	}
}

static size_t commands_of(const struct esi_device *device)
{
	return device == NULL ? 0 : device->command_count * CONFIG_TRANSITIONS;
}

static size_t described(const struct bus *bus)
{
	const struct esi_slot *slot;
	size_t count = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		count += commands_of(bus_esi_device(bus, i));
	}
	for (size_t i = 0; i < bus->module_count; i++) {
		count += commands_of(bus_esi_module(bus, &bus->module[i], &slot));
	}
	return count;
}

/* Types that slaves have given since the scan stay known. */
static void keep_types(struct bus *bus, const struct startup_command *old, size_t old_count)
{
	for (size_t i = 0; i < bus->startup_count; i++) {
		struct startup_command *command = &bus->startup[i];

		for (size_t k = 0; k < old_count && command->type == CONFIG_SDO_AUTO; k++) {
			if (old[k].untyped == command->untyped &&
			    old[k].slave_pos == command->slave_pos) {
				*command = old[k];
			}
		}
	}
}

int bus_startup_plan(struct bus *bus)
{
	struct startup_command *old = bus->startup;
	size_t old_count = bus->startup_count;
	size_t capacity =
		bus->slave_count + bus->cfg->sdo_count + bus->assign_count + described(bus);

	for (size_t i = 0; i < bus->slave_count; i++) {
		bus_startup_cancel(bus, i);
	}
	bus->startup_count = 0;
	bus->startup = calloc(capacity + 1, sizeof(bus->startup[0]));
	if (bus->startup == NULL) {
		free(old);
		return bus_fail(bus, -ENOMEM, "no memory for the start-up SDOs");
	}
	for (size_t i = 0; i < bus->slave_count; i++) {
		add_mode(bus, i);
		add_described(bus, i);
		add_assignment(bus, i);
		add_configured(bus, i);
	}
	keep_types(bus, old, old_count);
	free(old);
	return 0;
}

size_t bus_startup_list(const struct bus *bus, size_t pos, uint8_t *buf, size_t buf_len)
{
	size_t at = 0;

	for (size_t i = 0; i < bus->startup_count; i++) {
		const struct startup_command *command = &bus->startup[i];
		/* What waits for its type is listed without bytes. */
		uint16_t len = command->type == CONFIG_SDO_AUTO ? 0 : command->len;
		const struct startup_record record = { .line = (uint32_t)command->line,
						       .index = command->index,
						       .len = len,
						       .subindex = command->subindex,
						       .is_complete = command->is_complete,
						       .transition = (uint8_t)command->transition,
						       .origin = (uint8_t)command->origin };
		size_t bytes = startup_record_bytes(len);
		uint8_t value[8];

		if (command->slave_pos != pos) {
			continue;
		}
		if (at + bytes <= buf_len) {
			put_le64(value, command->value);
			memset(buf + at, 0, bytes);
			memcpy(buf + at, &record, sizeof(record));
			memcpy(buf + at + sizeof(record),
			       command->octets != NULL ? command->octets : value, len);
		}
		at += bytes;
	}
	return at;
}
