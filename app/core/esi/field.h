/* SPDX-License-Identifier: MIT */
/* Contents of the elements of an ESI file that are one number or text. Context: any. */
#ifndef ESI_FIELD_H
#define ESI_FIELD_H

#include <stddef.h>
#include <stdint.h>

#include "esi/device.h"
#include "esi/nodes.h"
#include "esi/xml.h"

struct esi_range {
	int64_t min;
	int64_t max;
};

/* The structure that a field is in: the device, or the newest of its lists. */
enum esi_base {
	ESI_BASE_DEVICE,
	ESI_BASE_PDO,
	ESI_BASE_ENTRY,
	ESI_BASE_MODE,
	ESI_BASE_COMMAND,
	ESI_BASE_SLOT,
};

struct esi_field {
	enum esi_node node;
	enum esi_base base;
	size_t at;
	size_t bytes;
	int is_text;
	struct esi_range range;
};

/* A text that is there in several languages. */
enum esi_text_policy { ESI_TEXT_FIRST, ESI_TEXT_REPLACED };

/** HexDecValue of ETG.2000: "#x1F" ("0x1f" as well), or decimal. 0; -EBADMSG with a line that names
 * @what. */
int esi_number(struct xml *xml, const char *what, const char *text, struct esi_range range,
	       int64_t *ret_value);
/** @text in one line, cut to fit, without blanks at its ends. */
void esi_text(const char *text, char *ret_text, size_t text_bytes);
/** Hexadecimal digits in pairs as the data of @command. */
int esi_octets(struct xml *xml, const char *text, struct esi_command *command);

/** NULL: the element is no single number or text. */
const struct esi_field *esi_field_of(enum esi_node node);
/** @text of element @name as @field of the structure @base. */
int esi_field_set(struct xml *xml, const struct esi_field *field, const char *name,
		  const char *text, void *base, enum esi_text_policy policy);

#endif
