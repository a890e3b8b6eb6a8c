/* SPDX-License-Identifier: MIT */
/* Contents of the elements of an ESI file that are one number or text. Context: any. */
#ifndef ESI_FIELD_H
#define ESI_FIELD_H

#include <stddef.h>
#include <stdint.h>

#include "esi/device.h"
#include "esi/nodes.h"
#include "xml/value.h"
#include "xml/xml.h"

/* The structure that a field is in: the device, or the newest of its lists or of those of its
 * dictionary. */
enum esi_base {
	ESI_BASE_DEVICE,
	ESI_BASE_PDO,
	ESI_BASE_ENTRY,
	ESI_BASE_MODE,
	ESI_BASE_COMMAND,
	ESI_BASE_SLOT,
	ESI_BASE_UNIT_TYPE,
	ESI_BASE_DATA_TYPE,
	ESI_BASE_PART,
	ESI_BASE_OBJECT,
	ESI_BASE_OBJECT_PART,
};

struct esi_field {
	enum esi_node node;
	enum esi_base base;
	size_t at;
	size_t bytes;
	int is_text;
	struct xml_range range;
};

/* A text that is there in several languages. */
enum esi_text_policy { ESI_TEXT_FIRST, ESI_TEXT_REPLACED };

/** NULL: the element is no single number or text. */
const struct esi_field *esi_field_of(enum esi_node node);
/** @text of element @name as @field of the structure @base. */
int esi_field_set(struct xml *xml, const struct esi_field *field, const char *name,
		  const char *text, void *base, enum esi_text_policy policy);

#endif
