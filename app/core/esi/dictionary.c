/* SPDX-License-Identifier: MIT */
#include "esi/dictionary.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "wire/coe_type.h"
#include "wire/coe_unit.h"
#include "xml/value.h"

/* --- while it is read --- */

#define GROW(xml, of, list, max, what)                                                             \
	do {                                                                                       \
		void *grown = xml_grow((xml), (of)->list, &(of)->list##_count,                     \
				       sizeof(*(of)->list), (struct xml_limit){ (max), (what) });  \
		if (grown == NULL) {                                                               \
			return -EBADMSG;                                                           \
		}                                                                                  \
		(of)->list = grown;                                                                \
	} while (0)

int esi_dictionary_unit_type(struct xml *xml, struct esi_dictionary *dict)
{
	GROW(xml, dict, unit_type, ESI_LIMIT_TYPES, "unit types of a device");
	return 0;
}

int esi_dictionary_type(struct xml *xml, struct esi_dictionary *dict)
{
	GROW(xml, dict, type, ESI_LIMIT_TYPES, "data types of a device");
	dict->type[dict->type_count - 1].first = dict->part_count;
	return 0;
}

int esi_dictionary_part(struct xml *xml, struct esi_dictionary *dict)
{
	GROW(xml, dict, part, ESI_LIMIT_OBJECTS, "parts of the data types of a device");
	dict->type[dict->type_count - 1].count++;
	return 0;
}

void esi_dictionary_object(struct esi_dictionary *dict)
{
	dict->object = (struct esi_object_text){ 0 };
	dict->object_part_count = 0;
}

int esi_dictionary_object_part(struct xml *xml, struct esi_dictionary *dict)
{
	GROW(xml, dict, object_part, UINT8_MAX + 1, "parts of an object");
	return 0;
}

void esi_dictionary_free(struct esi_dictionary *dict)
{
	free(dict->unit_type);
	free(dict->type);
	free(dict->part);
	free(dict->object_part);
	*dict = (struct esi_dictionary){ .unit_type = NULL };
}

/* --- what an object is made of --- */

static const struct esi_type *find_type(const struct esi_dictionary *dict, const char *name)
{
	for (size_t i = 0; i < dict->type_count; i++) {
		if (strcmp(dict->type[i].name, name) == 0) {
			return &dict->type[i];
		}
	}
	return NULL;
}

/* A code from 0xb6 on means what the vendor says; a prefix or a fraction of it is not known. */
static void put_unit(const struct esi_dictionary *dict, uint32_t code, char ret[COE_UNIT_BYTES])
{
	enum { OWN_FIRST = 0xb6 };

	coe_unit_format(code, ret);
	for (size_t i = 0; i < dict->unit_type_count; i++) {
		const struct esi_unit_type *own = &dict->unit_type[i];

		if (own->notation >= OWN_FIRST && code == (uint32_t)own->notation << 16) {
			memcpy(ret, own->symbol, sizeof(own->symbol));
		}
	}
}

struct entry {
	uint8_t subindex;
	const char *name;
	const char *type;
	uint32_t unit;
};

static int put_entry(struct xml *xml, const struct esi_dictionary *dict, const struct entry *from,
		     struct esi_device *device)
{
	const struct esi_type *own;
	struct esi_object *object;

	GROW(xml, device, object, ESI_LIMIT_OBJECTS, "dictionary entries of a device");
	object = &device->object[device->object_count - 1];
	object->index = dict->object.index;
	object->subindex = from->subindex;
	object->depends_on_slot = dict->object.depends_on_slot;
	object->type = coe_type_of_name(from->type);
	own = object->type == 0 ? find_type(dict, from->type) : NULL;
	if (own != NULL) {
		object->type = coe_type_of_name(own->base);
	}
	snprintf(object->name, sizeof(object->name), "%s", from->name);
	put_unit(dict, from->unit, object->unit);
	return 0;
}

/* What the object says of its @at-th part, which has @name in its data type: by the name, or where
 * none of its parts has that, by the order; NULL. */
static const struct esi_object_part *said(const struct esi_dictionary *dict, const char *name,
					  size_t at)
{
	const struct esi_object_part *named = NULL;

	for (size_t i = 0; i < dict->object_part_count; i++) {
		const struct esi_object_part *part = &dict->object_part[i];

		if (strcmp(part->name, name) == 0 && (named == NULL || i == at)) {
			named = part;
		}
	}
	return named != NULL || at >= dict->object_part_count ? named : &dict->object_part[at];
}

/* Elements have names of their own in the object only. */
static int put_array(struct xml *xml, const struct esi_dictionary *dict,
		     const struct esi_part *part, size_t at, struct esi_device *device)
{
	const struct esi_type *array = find_type(dict, part->type);
	uint32_t elements = array == NULL ? 0 : array->elements;
	int r = 0;

	if (dict->object_part_count == elements) {
		at = 0; /* the object leaves out its subindex 0 */
	}
	for (uint32_t i = 0; i < elements && r == 0 && array->low + i <= UINT8_MAX; i++) {
		const struct esi_object_part *own =
			at + i < dict->object_part_count ? &dict->object_part[at + i] : NULL;
		const struct entry entry = { .subindex = (uint8_t)(array->low + i),
					     .name = own == NULL ? "" : own->name,
					     .type = array->base,
					     .unit = own != NULL && own->unit != 0
							     ? own->unit
							     : dict->object.unit };

		r = put_entry(xml, dict, &entry, device);
	}
	return r;
}

int esi_dictionary_take(struct xml *xml, const struct esi_dictionary *dict,
			struct esi_device *device)
{
	const struct esi_object_text *object = &dict->object;
	const struct esi_type *type = find_type(dict, object->type);
	int r = 0;

	if (type == NULL || type->count == 0) {
		const struct entry entry = { .name = object->name,
					     .type = object->type,
					     .unit = object->unit };

		return put_entry(xml, dict, &entry, device);
	}
	for (size_t i = 0; i < type->count && r == 0; i++) {
		const struct esi_part *part = &dict->part[type->first + i];
		const struct esi_object_part *own = said(dict, part->name, i);
		const struct entry entry = { .subindex = part->subindex,
					     .name = part->name,
					     .type = part->type,
					     .unit = own == NULL ? 0 : own->unit };

		r = part->has_subindex ? put_entry(xml, dict, &entry, device)
				       : put_array(xml, dict, part, i, device);
	}
	return r;
}
