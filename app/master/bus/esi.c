/* SPDX-License-Identifier: MIT */
/* What the vendors' ESI files say of slaves, where these do not say it themselves. */
#include <errno.h>
#include <stdlib.h>

#include "base/utf8.h"
#include "bus/bus_internal.h"
#include "esi/library.h"

enum { TIMEOUT_MAX_MS = 5 * 60 * 1000 };

int bus_esi_load(struct bus *bus)
{
	struct esi_identity *wanted;

	bus->library = NULL;
	if (bus->esi.load == NULL) {
		return 0;
	}
	wanted = calloc(bus->slave_count + bus->module_count + 1, sizeof(*wanted));
	if (wanted == NULL) {
		return bus_fail(bus, -ENOMEM, "no memory for descriptions of the slaves");
	}
	for (size_t i = 0; i < bus->slave_count; i++) {
		const struct slave_info *info = &bus->slave[i].info;

		wanted[i] = (struct esi_identity){ .kind = ESI_DEVICE,
						   .vendor = info->vendor,
						   .product = info->product,
						   .revision = info->revision };
	}
	for (size_t i = 0; i < bus->module_count; i++) {
		const struct bus_module *module = &bus->module[i];

		wanted[bus->slave_count + i] =
			(struct esi_identity){ .kind = ESI_MODULE,
					       .vendor = bus->slave[module->slave_pos].info.vendor,
					       .product = module->ident };
	}
	bus->startup_count = 0; /* its commands are those of the library that ends now */
	bus->library = bus->esi.load(bus->esi.ctx, wanted, bus->slave_count + bus->module_count);
	free(wanted);
	return 0;
}

const struct esi_device *bus_esi_device(const struct bus *bus, size_t pos)
{
	const struct slave_info *info = &bus->slave[pos].info;

	return esi_library_find(bus->library, info->vendor, info->product, info->revision);
}

const struct esi_device *bus_esi_module(const struct bus *bus, const struct bus_module *module,
					const struct esi_slot **ret_slot)
{
	const struct slave_info *info = &bus->slave[module->slave_pos].info;
	const struct esi_device *device = bus_esi_device(bus, module->slave_pos);
	const struct esi_slot *slot = device == NULL ? NULL : esi_find_slot(device, module->slot);

	*ret_slot = slot;
	return slot == NULL ? NULL
			    : esi_library_find_module(bus->library, info->vendor, module->ident);
}

const char *bus_esi_device_name(const struct bus *bus, size_t pos)
{
	const struct esi_device *device = bus_esi_device(bus, pos);

	if (device == NULL) {
		return "";
	}
	return device->name[0] != '\0' ? device->name : device->type;
}

/* What slaves[].op_timeout may be, too. */
static int64_t limited_ns(uint32_t ms)
{
	return (ms < TIMEOUT_MAX_MS ? ms : TIMEOUT_MAX_MS) * NS_PER_MS;
}

void bus_esi_timeouts(struct bus *bus, size_t pos)
{
	const struct esi_device *device = bus_esi_device(bus, pos);
	struct bus_slave *sl = &bus->slave[pos];

	sl->esi = (struct esi_timeouts){ 0 };
	if (device != NULL) {
		sl->esi = (struct esi_timeouts){
			.preop_ns = limited_ns(device->preop_timeout_ms),
			.op_ns = limited_ns(device->safeop_op_timeout_ms),
			.back_to_init_ns = limited_ns(device->back_to_init_timeout_ms),
			.request_ns = limited_ns(device->request_timeout_ms),
			.response_ns = limited_ns(device->response_timeout_ms)
		};
	}
}

void bus_esi_modes(struct bus *bus, size_t pos)
{
	const struct esi_device *device = bus_esi_device(bus, pos);
	struct sii *sii = &bus->parsed;

	if (device == NULL || sii->dc_mode_count > 0) {
		return;
	}
	for (size_t i = 0; i < device->dc_count && i < SII_LIMIT_DC_MODES; i++) {
		const struct esi_dc_mode *mode = &device->dc[i];

		sii->dc_mode[sii->dc_mode_count++] =
			(struct sii_dc_mode){ .sync0_cycle_ns = mode->sync0_cycle_ns,
					      .sync0_shift_ns = mode->sync0_shift_ns,
					      .sync1_shift_ns = mode->sync1_shift_ns,
					      .sync1_factor = mode->sync1_factor,
					      .assign_activate = mode->assign_activate,
					      .sync0_factor = mode->sync0_factor };
	}
}

/* What @e has not. */
static void complete(struct pdo_entry *e, const struct esi_device *device, struct esi_shift shift)
{
	struct esi_known known = esi_find_known(device, shift, e->pdo, e->index, e->subindex);

	if (e->pdo_name[0] == '\0') {
		utf8_copy(known.pdo_name, e->pdo_name, sizeof(e->pdo_name));
	}
	if (e->name[0] == '\0') {
		utf8_copy(known.name, e->name, sizeof(e->name));
	}
	if (e->unit[0] == '\0') {
		utf8_copy(known.unit, e->unit, sizeof(e->unit));
	}
	e->data_type = e->data_type != 0 ? e->data_type : known.type;
}

static void complete_all(struct pdo_entry *entry, size_t count, const struct esi_device *device,
			 struct esi_shift shift)
{
	for (size_t i = 0; device != NULL && i < count; i++) {
		if (entry[i].index != 0) {
			complete(&entry[i], device, shift);
		}
	}
}

void bus_esi_names(const struct bus *bus, size_t pos, struct pdo_entry *entry, size_t count)
{
	complete_all(entry, count, bus_esi_device(bus, pos), (struct esi_shift){ 0, 0 });
	for (size_t i = 0; i < bus->module_count; i++) {
		const struct bus_module *module = &bus->module[i];

		if (module->slave_pos == pos) {
			const struct esi_slot *slot;
			const struct esi_device *device = bus_esi_module(bus, module, &slot);
			struct esi_shift shift = { 0, 0 };

			if (device != NULL) {
				shift.pdos = (uint16_t)(slot->pdo_increment * module->slot);
				shift.objects = (uint16_t)(slot->index_increment * module->slot);
			}
			complete_all(entry, count, device, shift);
		}
	}
}
