/* SPDX-License-Identifier: MIT */
/*
 * <Dictionary> of a device: an object has the name of a data type, whose parts give subindexes and
 * names; its own parts, in the order of these, give units. Made of it is one list of entries.
 * Context: any; one reader.
 */
#ifndef ESI_DICTIONARY_H
#define ESI_DICTIONARY_H

#include <stddef.h>
#include <stdint.h>

#include "esi/device.h"
#include "xml/xml.h"

enum { ESI_TYPE_BYTES = 48 };

/* <UnitType>: a unit of the vendor's own. */
struct esi_unit_type {
	uint8_t notation;
	char symbol[COE_UNIT_BYTES];
};

struct esi_type {
	char name[ESI_TYPE_BYTES];
	char base[ESI_TYPE_BYTES]; /* of an array, or of a type that renames another one */
	uint8_t low;               /* first subindex of an array */
	uint32_t elements;         /* 0: no array */
	size_t first;              /* of its parts */
	size_t count;
};

/* <SubItem> of a data type. */
struct esi_part {
	uint8_t has_subindex; /* 0: the elements of an array */
	uint8_t subindex;
	char name[ESI_NAME_BYTES];
	char type[ESI_TYPE_BYTES];
};

/* <Object>, and each <SubItem> in its <Info>. */
struct esi_object_text {
	uint16_t index;
	uint8_t depends_on_slot;
	uint32_t unit;
	char name[ESI_NAME_BYTES];
	char type[ESI_TYPE_BYTES];
};

struct esi_object_part {
	uint32_t unit;
	char name[ESI_NAME_BYTES];
};

/* Zero at first. */
struct esi_dictionary {
	struct esi_unit_type *unit_type;
	size_t unit_type_count;
	struct esi_type *type;
	size_t type_count;
	struct esi_part *part;
	size_t part_count;
	struct esi_object_text object; /* that is being read */
	struct esi_object_part *object_part;
	size_t object_part_count;
};

/* Another one, of another structure; 0; -EBADMSG with a line. */
int esi_dictionary_unit_type(struct xml *xml, struct esi_dictionary *dict);
int esi_dictionary_type(struct xml *xml, struct esi_dictionary *dict);
int esi_dictionary_part(struct xml *xml, struct esi_dictionary *dict);
int esi_dictionary_object_part(struct xml *xml, struct esi_dictionary *dict);
void esi_dictionary_object(struct esi_dictionary *dict);

/** The entries of the object that was read, to @device. 0; -EBADMSG with a line. */
int esi_dictionary_take(struct xml *xml, const struct esi_dictionary *dict,
			struct esi_device *device);
void esi_dictionary_free(struct esi_dictionary *dict);

#endif
