/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "esi/field.h"
#include "esi/reader.h"
#include "wire/sii.h"

/* --- lists --- */

/* The new row of a list of the device; it stays as it was where NULL comes. */
#define GROW(rd, list, max, what)                                                                  \
	xml_grow((rd)->xml, (rd)->device->list, &(rd)->device->list##_count,                       \
		 sizeof(*(rd)->device->list), (struct xml_limit){ (max), (what) })

/* --- attributes --- */

/* @ret_value is left alone where there is none. */
static int number_of(struct esi_reader *rd, const char **attribute, const char *name,
		     struct xml_range range, int64_t *ret_value)
{
	const char *text = xml_attribute(attribute, name);

	return text == NULL ? 0 : xml_number(rd->xml, name, text, range, ret_value);
}

static int is_set(const char **attribute, const char *name)
{
	const char *text = xml_attribute(attribute, name);

	return text != NULL && (strcmp(text, "1") == 0 || strcmp(text, "true") == 0);
}

/* --- beginnings --- */

void esi_forget(struct esi_reader *rd)
{
	esi_device_free(rd->device);
	rd->device = NULL;
}

static int begin_device(struct esi_reader *rd, enum esi_kind kind, const char **attribute)
{
	const char *physics = xml_attribute(attribute, "Physics");

	if (++rd->device_count > ESI_LIMIT_DEVICES) {
		return xml_fail(rd->xml, "more than %d devices", ESI_LIMIT_DEVICES);
	}
	if (rd->vendor == 0) {
		return xml_fail(rd->xml, "a device without <Vendor><Id> before it");
	}
	esi_forget(rd);
	rd->device = calloc(1, sizeof(*rd->device));
	if (rd->device == NULL) {
		return xml_fail(rd->xml, "out of memory");
	}
	rd->device_depth = rd->depth;
	rd->device->id = (struct esi_identity){ .kind = kind, .vendor = rd->vendor };
	rd->device->line = xml_line(rd->xml);
	memcpy(rd->device->vendor_name, rd->vendor_name, sizeof(rd->vendor_name));
	xml_plain(physics == NULL ? "" : physics, rd->device->physics, sizeof(rd->device->physics));
	return 0;
}

/* Here it shows whether the device is wanted: if not, it becomes an element like any other. */
static int begin_type(struct esi_reader *rd, const char **attribute)
{
	static const struct xml_range any = { 0, UINT32_MAX };
	struct esi_identity *id = &rd->device->id;
	int64_t product = 0;
	int64_t revision = 0;
	int r;

	if (id->kind == ESI_MODULE) {
		r = number_of(rd, attribute, "ModuleIdent", any, &product);
	} else {
		r = number_of(rd, attribute, "ProductCode", any, &product);
		r = r < 0 ? r : number_of(rd, attribute, "RevisionNo", any, &revision);
	}
	if (r < 0) {
		return r;
	}
	id->product = (uint32_t)product;
	id->revision = (uint32_t)revision;
	if (rd->visitor->select != NULL && !rd->visitor->select(rd->visitor->ctx, id)) {
		esi_forget(rd);
		for (int i = rd->device_depth; i <= rd->depth; i++) {
			rd->node[i] = ESI_NODE_OTHER;
		}
	}
	return 0;
}

static int begin_sm(struct esi_reader *rd, const char **attribute)
{
	static const struct xml_range octet = { 0, UINT8_MAX };
	static const struct xml_range word = { 0, UINT16_MAX };
	struct esi_device *device = rd->device;
	int64_t start = 0;
	int64_t bytes = 0;
	int64_t control = 0;
	int64_t enable = 0;
	int r;

	if (device->sm_count == ESI_LIMIT_SM) {
		return xml_fail(rd->xml, "more than %d SyncManagers", ESI_LIMIT_SM);
	}
	r = number_of(rd, attribute, "StartAddress", word, &start);
	r = r < 0 ? r : number_of(rd, attribute, "DefaultSize", word, &bytes);
	r = r < 0 ? r : number_of(rd, attribute, "ControlByte", octet, &control);
	r = r < 0 ? r : number_of(rd, attribute, "Enable", octet, &enable);
	if (r == 0) {
		device->sm[device->sm_count++] = (struct esi_sm){ .start = (uint16_t)start,
								  .bytes = (uint16_t)bytes,
								  .control = (uint8_t)control,
								  .enable = (uint8_t)enable };
	}
	return r;
}

static int begin_pdo(struct esi_reader *rd, int is_tx, const char **attribute)
{
	static const struct xml_range range = { 0, ESI_LIMIT_SM - 1 };
	struct esi_pdo *pdo = GROW(rd, pdo, ESI_LIMIT_PDOS, "PDOs of a device");
	int64_t sm = ESI_NO_SM;
	int r;

	if (pdo == NULL) {
		return -EBADMSG;
	}
	rd->device->pdo = pdo;
	pdo += rd->device->pdo_count - 1;
	r = number_of(rd, attribute, "Sm", range, &sm);
	pdo->sm = (int8_t)sm;
	pdo->is_tx = (uint8_t)is_tx;
	pdo->is_fixed = (uint8_t)is_set(attribute, "Fixed");
	pdo->is_mandatory = (uint8_t)is_set(attribute, "Mandatory");
	pdo->first = rd->device->entry_count;
	return r;
}

static int begin_entry(struct esi_reader *rd)
{
	struct esi_entry *entry = GROW(rd, entry, ESI_LIMIT_ENTRIES, "PDO entries of a device");

	if (entry == NULL) {
		return -EBADMSG;
	}
	rd->device->entry = entry;
	rd->device->pdo[rd->device->pdo_count - 1].count++;
	return 0;
}

static void begin_coe(struct esi_reader *rd, const char **attribute)
{
	static const struct {
		const char *name;
		enum esi_coe_flag flag;
	} flags[] = { { "SdoInfo", ESI_COE_SDO_INFO },
		      { "PdoAssign", ESI_COE_PDO_ASSIGN },
		      { "PdoConfig", ESI_COE_PDO_CONFIG },
		      { "PdoUpload", ESI_COE_PDO_UPLOAD },
		      { "CompleteAccess", ESI_COE_COMPLETE_ACCESS } };

	rd->device->protocols |= SII_MAILBOX_COE;
	for (size_t i = 0; i < sizeof(flags) / sizeof(flags[0]); i++) {
		if (is_set(attribute, flags[i].name)) {
			rd->device->coe |= (uint8_t)flags[i].flag;
		}
	}
}

static int begin_command(struct esi_reader *rd, const char **attribute)
{
	struct esi_command *command =
		GROW(rd, command, ESI_LIMIT_COMMANDS, "start-up commands of a device");

	if (command == NULL) {
		return -EBADMSG;
	}
	rd->device->command = command;
	command += rd->device->command_count - 1;
	command->is_complete_access = (uint8_t)is_set(attribute, "CompleteAccess");
	command->is_fixed = (uint8_t)is_set(attribute, "Fixed");
	return 0;
}

static int begin_cycle(struct esi_reader *rd, const char **attribute, int16_t *ret_factor)
{
	static const struct xml_range range = { INT16_MIN, INT16_MAX };
	int64_t factor = 0;
	int r = number_of(rd, attribute, "Factor", range, &factor);

	*ret_factor = (int16_t)factor;
	return r;
}

static int begin_slots(struct esi_reader *rd, const char **attribute)
{
	static const struct xml_range word = { 0, UINT16_MAX };
	int64_t pdos = 0;
	int64_t objects = 0;
	int r = number_of(rd, attribute, "SlotPdoIncrement", word, &pdos);

	r = r < 0 ? r : number_of(rd, attribute, "SlotIndexIncrement", word, &objects);
	rd->device->slot_pdo_increment = (uint16_t)pdos;
	rd->device->slot_index_increment = (uint16_t)objects;
	return r;
}

static int begin_slot(struct esi_reader *rd, const char **attribute)
{
	static const struct xml_range range = { 0, UINT16_MAX };
	struct esi_slot *slot = GROW(rd, slot, ESI_LIMIT_SLOTS, "slots of a device");
	int64_t min = 0;
	int64_t max = 0;
	int64_t pdos = rd->device->slot_pdo_increment;
	int64_t objects = rd->device->slot_index_increment;
	int r;

	if (slot == NULL) {
		return -EBADMSG;
	}
	rd->device->slot = slot;
	slot += rd->device->slot_count - 1;
	r = number_of(rd, attribute, "MinInstances", range, &min);
	r = r < 0 ? r : number_of(rd, attribute, "MaxInstances", range, &max);
	r = r < 0 ? r : number_of(rd, attribute, "SlotPdoIncrement", range, &pdos);
	r = r < 0 ? r : number_of(rd, attribute, "SlotIndexIncrement", range, &objects);
	slot->min = (uint32_t)min;
	slot->max = (uint32_t)max;
	slot->pdo_increment = (uint16_t)pdos;
	slot->index_increment = (uint16_t)objects;
	return r;
}

static int begin_group(struct esi_reader *rd)
{
	struct esi_group *group = xml_grow(rd->xml, rd->group, &rd->group_count, sizeof(*group),
					   (struct xml_limit){ ESI_LIMIT_GROUPS, "groups" });

	if (group == NULL) {
		return -EBADMSG;
	}
	rd->group = group;
	return 0;
}

static int begin_mode(struct esi_reader *rd)
{
	if (rd->device->dc_count == ESI_LIMIT_DC_MODES) {
		return xml_fail(rd->xml, "more than %d DC modes", ESI_LIMIT_DC_MODES);
	}
	memset(&rd->device->dc[rd->device->dc_count++], 0, sizeof(rd->device->dc[0]));
	return 0;
}

/* Another <EtherCATInfo> of a list: another vendor. */
static int begin_info(struct esi_reader *rd)
{
	rd->vendor = 0;
	rd->vendor_name[0] = '\0';
	rd->group_count = 0;
	return 0;
}

static int begin_dictionary(struct esi_reader *rd, enum esi_node node)
{
	struct esi_dictionary *dict = &rd->dictionary;

	if (node == ESI_NODE_DICTIONARY) {
		esi_dictionary_free(dict); /* of another profile, or device */
	}
	if (node == ESI_NODE_UNIT_TYPE) {
		return esi_dictionary_unit_type(rd->xml, dict);
	}
	if (node == ESI_NODE_DATA_TYPE) {
		return esi_dictionary_type(rd->xml, dict);
	}
	if (node == ESI_NODE_PART) {
		return esi_dictionary_part(rd->xml, dict);
	}
	if (node == ESI_NODE_PART_SUBINDEX) {
		dict->part[dict->part_count - 1].has_subindex = 1;
	}
	if (node == ESI_NODE_OBJECT) {
		esi_dictionary_object(dict);
	}
	return node == ESI_NODE_OBJECT_PART ? esi_dictionary_object_part(rd->xml, dict) : 0;
}

/* Of a module: the index is that of the first slot, the others have it further up. */
static void note_slot(struct esi_reader *rd, enum esi_node node, const char **attribute)
{
	struct esi_device *device = rd->device;
	uint8_t depends = (uint8_t)is_set(attribute, "DependOnSlot");

	if (node == ESI_NODE_PDO_INDEX) {
		device->pdo[device->pdo_count - 1].depends_on_slot = depends;
	}
	if (node == ESI_NODE_ENTRY_INDEX) {
		device->entry[device->entry_count - 1].depends_on_slot = depends;
	}
	if (node == ESI_NODE_COMMAND_INDEX) {
		device->command[device->command_count - 1].depends_on_slot = depends;
	}
	if (node == ESI_NODE_OBJECT_INDEX) {
		rd->dictionary.object.depends_on_slot = depends;
	}
}

/* Those with attributes or of which there are several. The names of all others are enough. */
static int begin_node(struct esi_reader *rd, enum esi_node node, const char **attribute)
{
	struct esi_device *device = rd->device;

	if (node == ESI_NODE_INFO) {
		return begin_info(rd);
	}
	if (node == ESI_NODE_GROUP) {
		return begin_group(rd);
	}
	if (node == ESI_NODE_DEVICE || node == ESI_NODE_MODULE) {
		return begin_device(rd, node == ESI_NODE_MODULE ? ESI_MODULE : ESI_DEVICE,
				    attribute);
	}
	if (node == ESI_NODE_TYPE) {
		return begin_type(rd, attribute);
	}
	if (node == ESI_NODE_SM) {
		return begin_sm(rd, attribute);
	}
	if (node == ESI_NODE_RX_PDO || node == ESI_NODE_TX_PDO) {
		return begin_pdo(rd, node == ESI_NODE_TX_PDO, attribute);
	}
	if (node == ESI_NODE_ENTRY) {
		return begin_entry(rd);
	}
	if (node == ESI_NODE_COMMAND) {
		return begin_command(rd, attribute);
	}
	if (node == ESI_NODE_MODE) {
		return begin_mode(rd);
	}
	if (node == ESI_NODE_MODE_CYCLE0) {
		return begin_cycle(rd, attribute, &device->dc[device->dc_count - 1].sync0_factor);
	}
	if (node == ESI_NODE_MODE_CYCLE1) {
		return begin_cycle(rd, attribute, &device->dc[device->dc_count - 1].sync1_factor);
	}
	if (node == ESI_NODE_SLOTS) {
		return begin_slots(rd, attribute);
	}
	return node == ESI_NODE_SLOT ? begin_slot(rd, attribute) : begin_dictionary(rd, node);
}

static void note_mailbox(struct esi_reader *rd, enum esi_node node, const char **attribute)
{
	static const struct {
		enum esi_node node;
		uint8_t protocol;
	} protocols[] = { { ESI_NODE_AOE, SII_MAILBOX_AOE },
			  { ESI_NODE_EOE, SII_MAILBOX_EOE },
			  { ESI_NODE_FOE, SII_MAILBOX_FOE },
			  { ESI_NODE_SOE, SII_MAILBOX_SOE },
			  { ESI_NODE_VOE, SII_MAILBOX_VOE } };

	if (node == ESI_NODE_MAILBOX) {
		rd->device->has_mailbox = 1;
	}
	if (node == ESI_NODE_COE) {
		begin_coe(rd, attribute);
	}
	for (size_t i = 0; i < sizeof(protocols) / sizeof(protocols[0]); i++) {
		if (protocols[i].node == node) {
			rd->device->protocols |= protocols[i].protocol;
		}
	}
}

int esi_begin(struct esi_reader *rd, enum esi_node node, const char **attribute)
{
	note_mailbox(rd, node, attribute);
	note_slot(rd, node, attribute);
	return begin_node(rd, node, attribute);
}
