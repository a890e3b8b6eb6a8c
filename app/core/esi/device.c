/* SPDX-License-Identifier: MIT */
#include "esi/device.h"

#include <stdlib.h>

void esi_device_free(struct esi_device *device)
{
	if (device == NULL) {
		return;
	}
	for (size_t i = 0; i < device->command_count; i++) {
		free(device->command[i].data);
	}
	free(device->command);
	free(device->pdo);
	free(device->entry);
	free(device->slot);
	free(device);
}

const struct esi_pdo *esi_find_pdo(const struct esi_device *device, uint16_t index)
{
	for (size_t i = 0; i < device->pdo_count; i++) {
		if (device->pdo[i].index == index) {
			return &device->pdo[i];
		}
	}
	return NULL;
}

static const struct esi_entry *entry_of(const struct esi_device *device, const struct esi_pdo *pdo,
					uint16_t index, uint8_t subindex)
{
	for (size_t i = 0; i < pdo->count; i++) {
		const struct esi_entry *entry = &device->entry[pdo->first + i];

		if (entry->index == index && entry->subindex == subindex) {
			return entry;
		}
	}
	return NULL;
}

const struct esi_entry *esi_find_entry(const struct esi_device *device, uint16_t pdo,
				       uint16_t index, uint8_t subindex)
{
	const struct esi_pdo *first = pdo == 0 ? NULL : esi_find_pdo(device, pdo);
	const struct esi_entry *found =
		first == NULL ? NULL : entry_of(device, first, index, subindex);

	for (size_t i = 0; i < device->pdo_count && found == NULL; i++) {
		found = entry_of(device, &device->pdo[i], index, subindex);
	}
	return found;
}
