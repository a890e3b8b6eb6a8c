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
	free(device->object);
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

const struct esi_slot *esi_find_slot(const struct esi_device *device, unsigned number)
{
	for (size_t i = 0; i < device->slot_count; i++) {
		if (number < device->slot[i].max) {
			return &device->slot[i];
		}
		number -= device->slot[i].max;
	}
	return NULL;
}

const struct esi_object *esi_find_object(const struct esi_device *device, uint16_t index,
					 uint8_t subindex)
{
	for (size_t i = 0; i < device->object_count; i++) {
		if (device->object[i].index == index && device->object[i].subindex == subindex) {
			return &device->object[i];
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

/* Has what the description gives as @index the index @wanted in its slot? */
static int is_at(uint16_t index, uint8_t depends_on_slot, uint16_t shift, uint16_t wanted)
{
	return (uint16_t)(index + (depends_on_slot ? shift : 0)) == wanted;
}

/* The entry, in @first (NULL: none) rather than in another PDO; NULL. */
static const struct esi_entry *entry_in_slot(const struct esi_device *device,
					     struct esi_shift shift, const struct esi_pdo *first,
					     uint16_t index, uint8_t subindex)
{
	const struct esi_entry *found = NULL;

	for (size_t i = 0; i < device->entry_count; i++) {
		const struct esi_entry *e = &device->entry[i];
		int is_first =
			first != NULL && i >= first->first && i < first->first + first->count;

		if (e->subindex == subindex && (found == NULL || is_first) &&
		    is_at(e->index, e->depends_on_slot, shift.objects, index)) {
			found = e;
			if (is_first) {
				break;
			}
		}
	}
	return found;
}

struct esi_known esi_find_known(const struct esi_device *device, struct esi_shift shift,
				uint16_t pdo, uint16_t index, uint8_t subindex)
{
	struct esi_known known = { "", "", "", 0 };
	const struct esi_pdo *first = NULL;
	const struct esi_entry *mapped;

	for (size_t i = 0; i < device->pdo_count && first == NULL; i++) {
		const struct esi_pdo *p = &device->pdo[i];

		first = is_at(p->index, p->depends_on_slot, shift.pdos, pdo) ? p : NULL;
	}
	if (first != NULL) {
		known.pdo_name = first->name;
	}
	mapped = entry_in_slot(device, shift, first, index, subindex);
	if (mapped != NULL) {
		known.name = mapped->name;
		known.type = mapped->type;
	}
	for (size_t i = 0; i < device->object_count; i++) {
		const struct esi_object *o = &device->object[i];

		if (o->subindex == subindex &&
		    is_at(o->index, o->depends_on_slot, shift.objects, index)) {
			known.name = known.name[0] != '\0' ? known.name : o->name;
			known.type = known.type != 0 ? known.type : o->type;
			known.unit = o->unit;
			break;
		}
	}
	return known;
}
