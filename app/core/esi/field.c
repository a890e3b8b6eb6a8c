/* SPDX-License-Identifier: MIT */
#include "esi/field.h"

#include <string.h>

#include "esi/dictionary.h"

/* clang-format off */
#define NUMBER(NODE, BASE, type, field, low, high)                                                 \
	{ ESI_NODE_##NODE, ESI_BASE_##BASE, offsetof(type, field), sizeof(((type *)0)->field), 0,  \
	  { low, high } }
#define TEXT(NODE, BASE, type, field)                                                              \
	{ ESI_NODE_##NODE, ESI_BASE_##BASE, offsetof(type, field), sizeof(((type *)0)->field), 1,  \
	  { 0, 0 } }
/* clang-format on */

static const struct esi_field fields[] = {
	TEXT(TYPE, DEVICE, struct esi_device, type),
	TEXT(NAME, DEVICE, struct esi_device, name),
	TEXT(GROUP_OF, DEVICE, struct esi_device, group),
	NUMBER(PREOP_TIMEOUT, DEVICE, struct esi_device, preop_timeout_ms, 0, UINT32_MAX),
	NUMBER(SAFEOP_OP_TIMEOUT, DEVICE, struct esi_device, safeop_op_timeout_ms, 0, UINT32_MAX),
	NUMBER(BACK_TO_INIT_TIMEOUT, DEVICE, struct esi_device, back_to_init_timeout_ms, 0,
	       UINT32_MAX),
	NUMBER(BACK_TO_SAFEOP_TIMEOUT, DEVICE, struct esi_device, back_to_safeop_timeout_ms, 0,
	       UINT32_MAX),
	NUMBER(REQUEST_TIMEOUT, DEVICE, struct esi_device, request_timeout_ms, 0, UINT32_MAX),
	NUMBER(RESPONSE_TIMEOUT, DEVICE, struct esi_device, response_timeout_ms, 0, UINT32_MAX),
	NUMBER(EEPROM_BYTES, DEVICE, struct esi_device, eeprom_bytes, 0, UINT32_MAX),
	NUMBER(PDO_INDEX, PDO, struct esi_pdo, index, 0, UINT16_MAX),
	TEXT(PDO_NAME, PDO, struct esi_pdo, name),
	NUMBER(ENTRY_INDEX, ENTRY, struct esi_entry, index, 0, UINT16_MAX),
	NUMBER(ENTRY_SUBINDEX, ENTRY, struct esi_entry, subindex, 0, UINT8_MAX),
	NUMBER(ENTRY_BITS, ENTRY, struct esi_entry, bits, 0, UINT16_MAX),
	TEXT(ENTRY_NAME, ENTRY, struct esi_entry, name),
	TEXT(ENTRY_TYPE, ENTRY, struct esi_entry, type_name),
	NUMBER(COMMAND_INDEX, COMMAND, struct esi_command, index, 0, UINT16_MAX),
	NUMBER(COMMAND_SUBINDEX, COMMAND, struct esi_command, subindex, 0, UINT8_MAX),
	TEXT(COMMAND_COMMENT, COMMAND, struct esi_command, comment),
	TEXT(MODE_NAME, MODE, struct esi_dc_mode, name),
	TEXT(MODE_TEXT, MODE, struct esi_dc_mode, text),
	NUMBER(MODE_ACTIVATE, MODE, struct esi_dc_mode, assign_activate, 0, UINT16_MAX),
	NUMBER(MODE_CYCLE0, MODE, struct esi_dc_mode, sync0_cycle_ns, 0, UINT32_MAX),
	NUMBER(MODE_SHIFT0, MODE, struct esi_dc_mode, sync0_shift_ns, INT32_MIN, INT32_MAX),
	NUMBER(MODE_SHIFT1, MODE, struct esi_dc_mode, sync1_shift_ns, INT32_MIN, INT32_MAX),
	TEXT(SLOT_NAME, SLOT, struct esi_slot, name),
	NUMBER(UNIT_TYPE_NOTATION, UNIT_TYPE, struct esi_unit_type, notation, 0, UINT8_MAX),
	TEXT(UNIT_TYPE_SYMBOL, UNIT_TYPE, struct esi_unit_type, symbol),
	TEXT(DATA_TYPE_NAME, DATA_TYPE, struct esi_type, name),
	TEXT(DATA_TYPE_BASE, DATA_TYPE, struct esi_type, base),
	NUMBER(ARRAY_LOW, DATA_TYPE, struct esi_type, low, 0, UINT8_MAX),
	NUMBER(ARRAY_ELEMENTS, DATA_TYPE, struct esi_type, elements, 0, UINT32_MAX),
	NUMBER(PART_SUBINDEX, PART, struct esi_part, subindex, 0, UINT8_MAX),
	TEXT(PART_NAME, PART, struct esi_part, name),
	TEXT(PART_TYPE, PART, struct esi_part, type),
	NUMBER(OBJECT_INDEX, OBJECT, struct esi_object_text, index, 0, UINT16_MAX),
	TEXT(OBJECT_NAME, OBJECT, struct esi_object_text, name),
	TEXT(OBJECT_TYPE, OBJECT, struct esi_object_text, type),
	NUMBER(OBJECT_UNIT, OBJECT, struct esi_object_text, unit, 0, UINT32_MAX),
	TEXT(OBJECT_PART_NAME, OBJECT_PART, struct esi_object_part, name),
	NUMBER(OBJECT_PART_UNIT, OBJECT_PART, struct esi_object_part, unit, 0, UINT32_MAX),
};

const struct esi_field *esi_field_of(enum esi_node node)
{
	for (size_t i = 0; i < sizeof(fields) / sizeof(fields[0]); i++) {
		if (fields[i].node == node) {
			return &fields[i];
		}
	}
	return NULL;
}

/* Of the size of the field; little-endian and big-endian machines alike. */
static void store(uint8_t *at, size_t bytes, int64_t value)
{
	uint8_t octet = (uint8_t)value;
	uint16_t word = (uint16_t)value;
	uint32_t dword = (uint32_t)value;

	memcpy(at,
	       bytes == 1   ? (const void *)&octet
	       : bytes == 2 ? (const void *)&word
			    : (const void *)&dword,
	       bytes);
}

int esi_field_set(struct xml *xml, const struct esi_field *field, const char *name,
		  const char *text, void *base, enum esi_text_policy policy)
{
	uint8_t *at = (uint8_t *)base + field->at;
	int64_t value = 0;
	int r;

	if (field->is_text) {
		if (*at == '\0' || policy == ESI_TEXT_REPLACED) {
			xml_plain(text, (char *)at, field->bytes);
		}
		return 0;
	}
	r = xml_number(xml, name, text, field->range, &value);
	if (r == 0) {
		store(at, field->bytes, value);
	}
	return r;
}
