/* SPDX-License-Identifier: MIT */
#include "cli/coe_type.h"

#include <stddef.h>
#include <stdio.h>

#include "wire/coe_type.h"

const char *coe_type_to_str(uint16_t type, char buf[TEXT_BYTES])
{
	const char *name = coe_type_name(type);

	if (name != NULL) {
		return name;
	}
	snprintf(buf, TEXT_BYTES, "0x%04x", type);
	return buf;
}

void coe_entry_json(struct json *js, const struct coe_entry *entry)
{
	char type[TEXT_BYTES];

	json_object_begin(js, NULL);
	json_u64(js, "index", entry->index);
	json_u64(js, "subindex", entry->subindex);
	json_u64(js, "bits", entry->bits);
	if (entry->type == 0) {
		json_null(js, "type");
	} else {
		json_text(js, "type", coe_type_to_str(entry->type, type));
	}
	json_text(js, "name", entry->name);
	json_object_end(js);
}
