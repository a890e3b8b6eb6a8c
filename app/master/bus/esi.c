/* SPDX-License-Identifier: MIT */
/* What the vendors' ESI files say of slaves, where these do not say it themselves. */
#include <errno.h>
#include <stdlib.h>

#include "base/utf8.h"
#include "bus/bus_internal.h"
#include "esi/library.h"

int bus_esi_load(struct bus *bus)
{
	struct esi_identity *wanted;

	bus->library = NULL;
	if (bus->esi.load == NULL) {
		return 0;
	}
	wanted = calloc(bus->slave_count + 1, sizeof(*wanted));
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
	bus->library = bus->esi.load(bus->esi.ctx, wanted, bus->slave_count);
	free(wanted);
	return 0;
}

static const struct esi_device *device_of(const struct bus *bus, size_t pos)
{
	const struct slave_info *info = &bus->slave[pos].info;

	return esi_library_find(bus->library, info->vendor, info->product, info->revision);
}

const char *bus_esi_device_name(const struct bus *bus, size_t pos)
{
	const struct esi_device *device = device_of(bus, pos);

	if (device == NULL) {
		return "";
	}
	return device->name[0] != '\0' ? device->name : device->type;
}

void bus_esi_modes(struct bus *bus, size_t pos)
{
	const struct esi_device *device = device_of(bus, pos);
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

void bus_esi_names(const struct bus *bus, size_t pos, struct pdo_entry *entry, size_t count)
{
	const struct esi_device *device = device_of(bus, pos);

	for (size_t i = 0; device != NULL && i < count; i++) {
		struct pdo_entry *e = &entry[i];
		const struct esi_pdo *pdo = esi_find_pdo(device, e->pdo);
		const struct esi_entry *found;

		if (e->index == 0) {
			continue;
		}
		if (pdo != NULL && e->pdo_name[0] == '\0') {
			utf8_copy(pdo->name, e->pdo_name, sizeof(e->pdo_name));
		}
		found = esi_find_entry(device, e->pdo, e->index, e->subindex);
		if (found != NULL && e->name[0] == '\0') {
			utf8_copy(found->name, e->name, sizeof(e->name));
		}
		if (found != NULL && e->data_type == 0) {
			e->data_type = found->type;
		}
	}
}
