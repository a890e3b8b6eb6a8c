/* SPDX-License-Identifier: MIT */
#include <string.h>

#include "esi/field.h"
#include "esi/reader.h"
#include "wire/coe_type.h"

/* The structure that the field of @node is in. */
static void *base_of(struct esi_reader *rd, enum esi_base base)
{
	struct esi_device *device = rd->device;
	struct esi_dictionary *dict = &rd->dictionary;

	switch (base) {
	case ESI_BASE_DEVICE:
		return device;
	case ESI_BASE_PDO:
		return &device->pdo[device->pdo_count - 1];
	case ESI_BASE_ENTRY:
		return &device->entry[device->entry_count - 1];
	case ESI_BASE_MODE:
		return &device->dc[device->dc_count - 1];
	case ESI_BASE_COMMAND:
		return &device->command[device->command_count - 1];
	case ESI_BASE_SLOT:
		return &device->slot[device->slot_count - 1];
	case ESI_BASE_UNIT_TYPE:
		return &dict->unit_type[dict->unit_type_count - 1];
	case ESI_BASE_DATA_TYPE:
		return &dict->type[dict->type_count - 1];
	case ESI_BASE_PART:
		return &dict->part[dict->part_count - 1];
	case ESI_BASE_OBJECT:
		return &dict->object;
	case ESI_BASE_OBJECT_PART:
		return &dict->object_part[dict->object_part_count - 1];
	}
	return NULL;
}

static uint8_t word_number(const char *text, const char *const *words, uint8_t count)
{
	for (uint8_t i = 0; i < count; i++) {
		if (strcmp(text, words[i]) == 0) {
			return (uint8_t)(i + 1);
		}
	}
	return 0;
}

static int end_fmmu(struct esi_reader *rd, const char *text)
{
	static const char *const words[] = { "Outputs", "Inputs", "MBoxState" };
	struct esi_device *device = rd->device;

	if (device->fmmu_count == ESI_LIMIT_FMMU) {
		return xml_fail(rd->xml, "more than %d FMMUs", ESI_LIMIT_FMMU);
	}
	device->fmmu[device->fmmu_count++] = word_number(text, words, 3);
	return 0;
}

static void end_sm(struct esi_reader *rd, const char *text)
{
	static const char *const words[] = { "MBoxOut", "MBoxIn", "Outputs", "Inputs" };

	rd->device->sm[rd->device->sm_count - 1].type = word_number(text, words, 4);
}

static int end_exclude(struct esi_reader *rd, const char *text)
{
	static const struct xml_range word = { 0, UINT16_MAX };
	struct esi_pdo *pdo = &rd->device->pdo[rd->device->pdo_count - 1];
	int64_t index = 0;
	int r = xml_number(rd->xml, "Exclude", text, word, &index);

	if (r == 0 && pdo->exclude_count == ESI_LIMIT_EXCLUDES) {
		return xml_fail(rd->xml, "more than %d PDOs excluded by one", ESI_LIMIT_EXCLUDES);
	}
	if (r == 0) {
		pdo->exclude[pdo->exclude_count++] = (uint16_t)index;
	}
	return r;
}

static void end_entry(struct esi_reader *rd)
{
	struct esi_pdo *pdo = &rd->device->pdo[rd->device->pdo_count - 1];
	struct esi_entry *entry = &rd->device->entry[rd->device->entry_count - 1];

	entry->type = entry->index == 0 ? 0 : coe_type_of_name(entry->type_name);
	pdo->bits += entry->bits;
}

static void end_transition(struct esi_reader *rd, const char *text)
{
	static const char *const words[] = { "IP", "PS", "SO", "OS", "SP", "PI" };
	unsigned number = word_number(text, words, 6);

	rd->device->command[rd->device->command_count - 1].transitions |=
		(uint8_t)(number == 0 ? ESI_TRANSITION_OTHER : 1u << (number - 1));
}

static int end_slot_module(struct esi_reader *rd, const char *text)
{
	static const struct xml_range any = { 0, UINT32_MAX };
	struct esi_slot *slot = &rd->device->slot[rd->device->slot_count - 1];
	int64_t ident = 0;
	int r = xml_number(rd->xml, "ModuleIdent", text, any, &ident);

	if (r == 0 && slot->module_count++ == 0) {
		slot->module = (uint32_t)ident;
	}
	return r;
}

static void end_vendor_name(struct esi_reader *rd, const char *text)
{
	if (rd->vendor_name[0] == '\0' || rd->is_name_preferred) {
		xml_plain(text, rd->vendor_name, sizeof(rd->vendor_name));
	}
}

static int end_vendor_id(struct esi_reader *rd, const char *text)
{
	static const struct xml_range any = { 1, UINT32_MAX };
	int64_t vendor = 0;
	int r = xml_number(rd->xml, "Id", text, any, &vendor);

	if (r == 0) {
		rd->vendor = (uint32_t)vendor;
	}
	return r;
}

static void end_group_text(struct esi_reader *rd, enum esi_node node, const char *text)
{
	struct esi_group *group = &rd->group[rd->group_count - 1];
	char *name = node == ESI_NODE_GROUP_TYPE ? group->type : group->name;

	if (name[0] == '\0' || rd->is_name_preferred) {
		xml_plain(text, name, ESI_NAME_BYTES);
	}
}

static int end_device(struct esi_reader *rd)
{
	struct esi_device *device = rd->device;

	for (size_t i = 0; i < rd->group_count; i++) {
		if (strcmp(rd->group[i].type, device->group) == 0) {
			memcpy(device->group_name, rd->group[i].name, ESI_NAME_BYTES);
		}
	}
	rd->device = NULL; /* the visitor's */
	return rd->visitor->device(rd->visitor->ctx, device);
}

/* What is more than one number or text. */
static int end_command_data(struct esi_reader *rd, const char *text)
{
	struct esi_command *command = &rd->device->command[rd->device->command_count - 1];
	size_t len = 0;
	int r = xml_octets(rd->xml, text, ESI_LIMIT_COMMAND_BYTES, &command->data, &len);

	if (r == 0) {
		command->len = (uint16_t)len;
	}
	return r;
}

static int end_node(struct esi_reader *rd, enum esi_node node, const char *text)
{
	if (node == ESI_NODE_VENDOR_ID) {
		return end_vendor_id(rd, text);
	}
	if (node == ESI_NODE_VENDOR_NAME) {
		end_vendor_name(rd, text);
	}
	if (node == ESI_NODE_GROUP_TYPE || node == ESI_NODE_GROUP_NAME) {
		end_group_text(rd, node, text);
	}
	if (node == ESI_NODE_FMMU) {
		return end_fmmu(rd, text);
	}
	if (node == ESI_NODE_SM) {
		end_sm(rd, text);
	}
	if (node == ESI_NODE_PDO_EXCLUDE) {
		return end_exclude(rd, text);
	}
	if (node == ESI_NODE_ENTRY) {
		end_entry(rd);
	}
	if (node == ESI_NODE_COMMAND_TRANSITION) {
		end_transition(rd, text);
	}
	if (node == ESI_NODE_COMMAND_DATA) {
		return end_command_data(rd, text);
	}
	if (node == ESI_NODE_OBJECT) {
		return esi_dictionary_take(rd->xml, &rd->dictionary, rd->device);
	}
	if (node == ESI_NODE_SLOT_MODULE) {
		return end_slot_module(rd, text);
	}
	return node == ESI_NODE_DEVICE || node == ESI_NODE_MODULE ? end_device(rd) : 0;
}

int esi_end(struct esi_reader *rd, enum esi_node node, const char *name, const char *text)
{
	const struct esi_field *field = esi_field_of(node);

	if (field != NULL) {
		return esi_field_set(rd->xml, field, name, text, base_of(rd, field->base),
				     rd->is_name_preferred ? ESI_TEXT_REPLACED : ESI_TEXT_FIRST);
	}
	return end_node(rd, node, text);
}
