/* SPDX-License-Identifier: MIT */
#include "esi/field.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/utf8.h"

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

int esi_number(struct xml *xml, const char *what, const char *text, struct esi_range range,
	       int64_t *ret_value)
{
	int is_hex = (text[0] == '#' || text[0] == '0') && (text[1] == 'x' || text[1] == 'X');
	const char *digits = text + (is_hex ? 2 : text[0] == '-' || text[0] == '+');
	char *end;
	long long value;

	errno = 0;
	value = strtoll(is_hex ? digits : text, &end, is_hex ? 16 : 10);
	if (!isxdigit((unsigned char)digits[0]) || *end != '\0') {
		return xml_fail(xml, "%s: \"%.40s\" is no number (#x1F or 31)", what, text);
	}
	if (errno != 0 || value < range.min || value > range.max) {
		return xml_fail(xml, "%s: %.40s is not within %" PRId64 " to %" PRId64, what, text,
				range.min, range.max);
	}
	*ret_value = value;
	return 0;
}

void esi_text(const char *text, char *ret_text, size_t text_bytes)
{
	size_t len;

	utf8_copy(text, ret_text, text_bytes);
	for (char *p = ret_text; *p != '\0'; p++) {
		if ((unsigned char)*p < 0x20 || *p == 0x7f) {
			*p = ' ';
		}
	}
	/* Cut, it may end in a blank. */
	len = strlen(ret_text);
	while (len > 0 && ret_text[len - 1] == ' ') {
		len--;
	}
	ret_text[len] = '\0';
	memmove(ret_text, ret_text + strspn(ret_text, " "), len + 1 - strspn(ret_text, " "));
}

static int digit(char c)
{
	if (!isxdigit((unsigned char)c)) {
		return -1;
	}
	return isdigit((unsigned char)c) ? c - '0' : tolower((unsigned char)c) - 'a' + 10;
}

int esi_octets(struct xml *xml, const char *text, struct esi_command *command)
{
	size_t len = strlen(text);
	uint8_t *data;

	if (len % 2 != 0 || strspn(text, "0123456789abcdefABCDEF") != len) {
		return xml_fail(xml, "Data: \"%.40s\" is no row of hexadecimal octets", text);
	}
	if (len / 2 > ESI_LIMIT_COMMAND_BYTES) {
		return xml_fail(xml, "Data: more than %d octets", ESI_LIMIT_COMMAND_BYTES);
	}
	data = malloc(len / 2 + 1);
	if (data == NULL) {
		return xml_fail(xml, "out of memory");
	}
	for (size_t i = 0; i < len / 2; i++) {
		data[i] = (uint8_t)(digit(text[2 * i]) << 4 | digit(text[2 * i + 1]));
	}
	free(command->data);
	command->data = data;
	command->len = (uint16_t)(len / 2);
	return 0;
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
			esi_text(text, (char *)at, field->bytes);
		}
		return 0;
	}
	r = esi_number(xml, name, text, field->range, &value);
	if (r == 0) {
		store(at, field->bytes, value);
	}
	return r;
}
