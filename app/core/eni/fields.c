/* SPDX-License-Identifier: MIT */
#include "eni/fields.h"

#include <assert.h>
#include <ctype.h>
#include <errno.h>
#include <string.h>

#include "eni/eni.h"

/* --- words --- */

static const char *const transitions[] = { "II", "IP", "PS", "SO", "OS", "SP", "PI", "SI", "OI",
					   "OP", "IB", "BI", "PP", "SS", "OO", "BB", NULL };
static const char *const states[] = { "INIT", "PREOP", "SAFEOP", "OP", NULL };
static const char *const protocols[] = { "AoE", "EoE", "CoE", "FoE", "SoE", "VoE", NULL };

/* --- fields, in the order of the schema --- */

#define FIELD(NAME, KIND, MAX, type, member)                                                       \
	{ (NAME), ENI_KIND_##KIND, (MAX), offsetof(type, member), NULL }
#define WORDS(NAME, list, type, member)                                                            \
	{ (NAME), ENI_KIND_WORDS, 0, offsetof(type, member), (list) }
#define NAMED(NAME, type, member) FIELD(NAME, TEXT, sizeof(((type *)0)->member), type, member)

static const struct eni_field master_info[] = {
	NAMED("Name", struct eni_master, name),
	NAMED("Destination", struct eni_master, destination),
	NAMED("Source", struct eni_master, source),
	NAMED("EtherType", struct eni_master, ether_type),
};

static const struct eni_field mailbox_states[] = {
	FIELD("StartAddr", PATTERN, UINT32_MAX, struct eni_mailbox_states, start),
	FIELD("Count", NUMBER, UINT16_MAX, struct eni_mailbox_states, count),
};

static const struct eni_field info[] = {
	NAMED("Name", struct eni_info, name),
	FIELD("PhysAddr", NUMBER, UINT16_MAX, struct eni_info, phys_addr),
	FIELD("AutoIncAddr", PATTERN, UINT16_MAX, struct eni_info, auto_inc_addr),
	NAMED("Physics", struct eni_info, physics),
	FIELD("VendorId", PATTERN, UINT32_MAX, struct eni_info, vendor),
	FIELD("ProductCode", PATTERN, UINT32_MAX, struct eni_info, product),
	FIELD("RevisionNo", PATTERN, UINT32_MAX, struct eni_info, revision),
	FIELD("SerialNo", PATTERN, UINT32_MAX, struct eni_info, serial),
};

static const struct eni_field identification[] = {
	FIELD("@Value", NUMBER, UINT16_MAX, struct eni_identification, value),
	FIELD("Ado", NUMBER, UINT16_MAX, struct eni_identification, ado),
};

static const struct eni_field range[] = {
	FIELD("BitStart", NUMBER, INT32_MAX, struct eni_range, start),
	FIELD("BitLength", NUMBER, INT32_MAX, struct eni_range, len),
};

static const struct eni_field sm[] = {
	NAMED("Type", struct eni_sm, type),
	FIELD("MinSize", NUMBER, UINT16_MAX, struct eni_sm, min),
	FIELD("MaxSize", NUMBER, UINT16_MAX, struct eni_sm, max),
	FIELD("DefaultSize", NUMBER, UINT16_MAX, struct eni_sm, bytes),
	FIELD("StartAddress", NUMBER, UINT16_MAX, struct eni_sm, start),
	FIELD("ControlByte", NUMBER, UINT8_MAX, struct eni_sm, control),
	FIELD("Enable", TRUTH, 1, struct eni_sm, enable),
	FIELD("Pdo", INDEXES, UINT16_MAX, struct eni_sm, pdo),
};

static const struct eni_field pdo[] = {
	FIELD("@Fixed", TRUTH, 1, struct eni_pdo, is_fixed),
	FIELD("@Mandatory", TRUTH, 1, struct eni_pdo, is_mandatory),
	FIELD("@Sm", NUMBER, ENI_LIMIT_SM - 1, struct eni_pdo, sm),
	FIELD("Index", HEX, UINT16_MAX, struct eni_pdo, index),
	NAMED("Name", struct eni_pdo, name),
	FIELD("Exclude", INDEXES, UINT16_MAX, struct eni_pdo, exclude),
};

static const struct eni_field entry[] = {
	FIELD("Index", HEX, UINT16_MAX, struct eni_entry, index),
	FIELD("SubIndex", NUMBER, UINT8_MAX, struct eni_entry, subindex),
	FIELD("BitLen", NUMBER, UINT16_MAX, struct eni_entry, bits),
	NAMED("Name", struct eni_entry, name),
	NAMED("Comment", struct eni_entry, comment),
	NAMED("DataType", struct eni_entry, type),
};

static const struct eni_field mailbox[] = {
	WORDS("Protocol", protocols, struct eni_mailbox, protocols),
};

static const struct eni_field area[] = {
	FIELD("Start", NUMBER, UINT16_MAX, struct eni_area, start),
	FIELD("Length", NUMBER, UINT16_MAX, struct eni_area, len),
	FIELD("PollTime", NUMBER, UINT32_MAX, struct eni_area, poll_time_ms),
	FIELD("StatusBitAddr", PATTERN, UINT32_MAX, struct eni_area, status_bit),
};

static const struct eni_field port[] = {
	FIELD("@Selected", TRUTH, 1, struct eni_port, is_selected),
	NAMED("Port", struct eni_port, port),
	FIELD("PhysAddr", NUMBER, UINT16_MAX, struct eni_port, phys_addr),
};

static const struct eni_field dc[] = {
	FIELD("PotentialReferenceClock", TRUTH, 1, struct eni_dc, is_potential),
	FIELD("ReferenceClock", TRUTH, 1, struct eni_dc, is_reference),
	FIELD("CycleTime0", SIGNED, INT32_MAX, struct eni_dc, cycle0_ns),
	FIELD("CycleTime1", SIGNED, INT32_MAX, struct eni_dc, cycle1_ns),
	FIELD("ShiftTime", SIGNED, INT32_MAX, struct eni_dc, shift_ns),
};

static const struct eni_field init[] = {
	WORDS("Transition", transitions, struct eni_command, transitions),
	FIELD("BeforeSlave", TRUTH, 1, struct eni_command, is_before_slave),
	NAMED("Comment", struct eni_command, comment),
	NAMED("Requires", struct eni_command, requires),
	FIELD("Cmd", NUMBER, UINT8_MAX, struct eni_command, cmd),
	FIELD("Adp", PATTERN, UINT16_MAX, struct eni_command, adp),
	FIELD("Ado", NUMBER, UINT16_MAX, struct eni_command, ado),
	FIELD("Addr", PATTERN, UINT32_MAX, struct eni_command, addr),
	FIELD("Data", OCTETS, ENI_LIMIT_OCTETS, struct eni_command, data),
	FIELD("DataLength", NUMBER, UINT16_MAX, struct eni_command, data_len),
	FIELD("Cnt", NUMBER, UINT16_MAX, struct eni_command, cnt),
	FIELD("Retries", NUMBER, UINT16_MAX, struct eni_command, retries),
	FIELD("Timeout", NUMBER, UINT32_MAX, struct eni_command, timeout_ms),
};

static const struct eni_field validate[] = {
	FIELD("Data", OCTETS, ENI_LIMIT_OCTETS, struct eni_validate, data),
	FIELD("DataMask", OCTETS, ENI_LIMIT_OCTETS, struct eni_validate, mask),
	FIELD("Timeout", NUMBER, UINT32_MAX, struct eni_validate, timeout_ms),
};

static const struct eni_field cmd[] = {
	WORDS("State", states, struct eni_command, states),
	NAMED("Comment", struct eni_command, comment),
	FIELD("Cmd", NUMBER, UINT8_MAX, struct eni_command, cmd),
	FIELD("Adp", PATTERN, UINT16_MAX, struct eni_command, adp),
	FIELD("Ado", NUMBER, UINT16_MAX, struct eni_command, ado),
	FIELD("Addr", PATTERN, UINT32_MAX, struct eni_command, addr),
	FIELD("Data", OCTETS, ENI_LIMIT_OCTETS, struct eni_command, data),
	FIELD("DataLength", NUMBER, UINT16_MAX, struct eni_command, data_len),
	FIELD("Cnt", NUMBER, UINT16_MAX, struct eni_command, cnt),
	FIELD("InputOffs", NUMBER, UINT32_MAX, struct eni_command, input_offs),
	FIELD("OutputOffs", NUMBER, UINT32_MAX, struct eni_command, output_offs),
};

static const struct eni_field coe_init[] = {
	FIELD("@Fixed", TRUTH, 1, struct eni_coe, is_fixed),
	FIELD("@CompleteAccess", TRUTH, 1, struct eni_coe, is_complete),
	WORDS("Transition", transitions, struct eni_coe, transitions),
	NAMED("Comment", struct eni_coe, comment),
	FIELD("Timeout", NUMBER, UINT32_MAX, struct eni_coe, timeout_ms),
	FIELD("Ccs", NUMBER, UINT8_MAX, struct eni_coe, ccs),
	FIELD("Index", NUMBER, UINT16_MAX, struct eni_coe, index),
	FIELD("SubIndex", NUMBER, UINT8_MAX, struct eni_coe, subindex),
	FIELD("Data", OCTETS, ENI_LIMIT_OCTETS, struct eni_coe, data),
	FIELD("Disabled", TRUTH, 1, struct eni_coe, is_disabled),
};

static const struct eni_field cyclic[] = {
	NAMED("Comment", struct eni_cyclic, comment),
	FIELD("CycleTime", NUMBER, UINT32_MAX, struct eni_cyclic, cycle_us),
	FIELD("Priority", NUMBER, UINT8_MAX, struct eni_cyclic, priority),
	NAMED("TaskId", struct eni_cyclic, task),
};

static const struct eni_field frame[] = {
	NAMED("Comment", struct eni_frame, comment),
};

static const struct eni_field image[] = {
	FIELD("ByteSize", NUMBER, INT32_MAX, struct eni_image, bytes),
};

static const struct eni_field variable[] = {
	NAMED("Name", struct eni_variable, name),
	NAMED("Comment", struct eni_variable, comment),
	NAMED("DataType", struct eni_variable, type),
	FIELD("BitSize", NUMBER, INT32_MAX, struct eni_variable, bits),
	FIELD("BitOffs", NUMBER, INT32_MAX, struct eni_variable, offset),
};

/* --- elements --- */

#define TABLE(list) { (list), sizeof(list) / sizeof((list)[0]) }
#define NO_TABLE { NULL, 0 }

static const struct {
	enum eni_node parent;
	const char *name;
	enum eni_node node;
	struct eni_table table;
} nodes[] = {
	{ ENI_NODE_ROOT, "EtherCATConfig", ENI_NODE_FILE, NO_TABLE },
	{ ENI_NODE_FILE, "Config", ENI_NODE_CONFIG, NO_TABLE },
	{ ENI_NODE_CONFIG, "Master", ENI_NODE_MASTER, NO_TABLE },
	{ ENI_NODE_MASTER, "Info", ENI_NODE_MASTER_INFO, TABLE(master_info) },
	{ ENI_NODE_MASTER, "MailboxStates", ENI_NODE_MAILBOX_STATES, TABLE(mailbox_states) },
	{ ENI_NODE_MASTER, "InitCmds", ENI_NODE_INITS, NO_TABLE },
	{ ENI_NODE_INITS, "InitCmd", ENI_NODE_INIT, TABLE(init) },
	{ ENI_NODE_INIT, "Validate", ENI_NODE_VALIDATE, TABLE(validate) },
	{ ENI_NODE_CONFIG, "Slave", ENI_NODE_SLAVE, NO_TABLE },
	{ ENI_NODE_SLAVE, "Info", ENI_NODE_INFO, TABLE(info) },
	{ ENI_NODE_INFO, "Identification", ENI_NODE_IDENTIFICATION, TABLE(identification) },
	{ ENI_NODE_SLAVE, "ProcessData", ENI_NODE_PROCESS_DATA, NO_TABLE },
	{ ENI_NODE_PROCESS_DATA, "Send", ENI_NODE_SEND, TABLE(range) },
	{ ENI_NODE_PROCESS_DATA, "Recv", ENI_NODE_RECV, TABLE(range) },
	{ ENI_NODE_PROCESS_DATA, "Sm", ENI_NODE_SM, TABLE(sm) },
	{ ENI_NODE_PROCESS_DATA, "RxPdo", ENI_NODE_RX_PDO, TABLE(pdo) },
	{ ENI_NODE_PROCESS_DATA, "TxPdo", ENI_NODE_TX_PDO, TABLE(pdo) },
	{ ENI_NODE_RX_PDO, "Entry", ENI_NODE_ENTRY, TABLE(entry) },
	{ ENI_NODE_TX_PDO, "Entry", ENI_NODE_ENTRY, TABLE(entry) },
	{ ENI_NODE_SLAVE, "Mailbox", ENI_NODE_MAILBOX, TABLE(mailbox) },
	{ ENI_NODE_MAILBOX, "Send", ENI_NODE_MAILBOX_SEND, TABLE(area) },
	{ ENI_NODE_MAILBOX, "Recv", ENI_NODE_MAILBOX_RECV, TABLE(area) },
	{ ENI_NODE_MAILBOX, "BootStrap", ENI_NODE_BOOT, NO_TABLE },
	{ ENI_NODE_BOOT, "Send", ENI_NODE_BOOT_SEND, TABLE(area) },
	{ ENI_NODE_BOOT, "Recv", ENI_NODE_BOOT_RECV, TABLE(area) },
	{ ENI_NODE_MAILBOX, "CoE", ENI_NODE_COE, NO_TABLE },
	{ ENI_NODE_COE, "InitCmds", ENI_NODE_COE_INITS, NO_TABLE },
	{ ENI_NODE_COE_INITS, "InitCmd", ENI_NODE_COE_INIT, TABLE(coe_init) },
	{ ENI_NODE_SLAVE, "InitCmds", ENI_NODE_INITS, NO_TABLE },
	{ ENI_NODE_SLAVE, "PreviousPort", ENI_NODE_PORT, TABLE(port) },
	{ ENI_NODE_SLAVE, "DC", ENI_NODE_DC, TABLE(dc) },
	{ ENI_NODE_CONFIG, "Cyclic", ENI_NODE_CYCLIC, TABLE(cyclic) },
	{ ENI_NODE_CYCLIC, "Frame", ENI_NODE_FRAME, TABLE(frame) },
	{ ENI_NODE_FRAME, "Cmd", ENI_NODE_CMD, TABLE(cmd) },
	{ ENI_NODE_CONFIG, "ProcessImage", ENI_NODE_IMAGE, NO_TABLE },
	{ ENI_NODE_IMAGE, "Inputs", ENI_NODE_INPUTS, TABLE(image) },
	{ ENI_NODE_IMAGE, "Outputs", ENI_NODE_OUTPUTS, TABLE(image) },
	{ ENI_NODE_INPUTS, "Variable", ENI_NODE_VARIABLE, TABLE(variable) },
	{ ENI_NODE_OUTPUTS, "Variable", ENI_NODE_VARIABLE, TABLE(variable) },
};

enum { NODE_COUNT = sizeof(nodes) / sizeof(nodes[0]) };

/* "Sm0" to "Sm15" are all "Sm". */
static int is_named(size_t row, const char *name)
{
	size_t len = strlen(nodes[row].name);

	if (nodes[row].node != ENI_NODE_SM) {
		return strcmp(nodes[row].name, name) == 0;
	}
	return strncmp(name, nodes[row].name, len) == 0 && isdigit((unsigned char)name[len]);
}

enum eni_node eni_node_find(enum eni_node parent, const char *name, size_t *ret_field)
{
	struct eni_table table = eni_table_of(parent);

	for (size_t i = 0; i < NODE_COUNT; i++) {
		if (nodes[i].parent == parent && is_named(i, name)) {
			return nodes[i].node;
		}
	}
	for (size_t i = 0; i < table.count; i++) {
		if (strcmp(table.field[i].name, name) == 0) {
			*ret_field = i;
			return ENI_NODE_FIELD;
		}
	}
	return ENI_NODE_OTHER;
}

static size_t row_of(enum eni_node node)
{
	size_t i = 0;

	while (i < NODE_COUNT && nodes[i].node != node) {
		i++;
	}
	return i;
}

const char *eni_node_name(enum eni_node node)
{
	size_t row = row_of(node);

	return row < NODE_COUNT ? nodes[row].name : "";
}

struct eni_table eni_table_of(enum eni_node node)
{
	size_t row = row_of(node);

	return row < NODE_COUNT ? nodes[row].table : (struct eni_table){ NULL, 0 };
}

void eni_has_all(enum eni_node node, void *base, uint32_t except)
{
	uint32_t has = ENI_IS_THERE | (ENI_HAS(eni_table_of(node).count) - 1);

	has &= ~except;
	memcpy(base, &has, sizeof(has));
}

/* --- from text --- */

static int set_number(struct xml *xml, const struct eni_field *field, const char *text, void *at)
{
	struct xml_range limits = { 0, field->max };
	int64_t value = 0;
	uint32_t number;
	int r;

	if (field->kind == ENI_KIND_SIGNED) {
		limits.min = -(int64_t)field->max - 1;
	} else if (field->kind == ENI_KIND_PATTERN) {
		limits.min = -((int64_t)field->max + 1) / 2;
	}
	r = xml_number(xml, field->name, text, limits, &value);
	if (r == 0) {
		number = (uint32_t)value &
			 (field->kind == ENI_KIND_PATTERN ? field->max : UINT32_MAX);
		memcpy(at, &number, sizeof(number));
	}
	return r;
}

static int set_truth(struct xml *xml, const struct eni_field *field, const char *text, void *at)
{
	uint32_t value = strcmp(text, "1") == 0 || strcmp(text, "true") == 0;

	if (value == 0 && strcmp(text, "0") != 0 && strcmp(text, "false") != 0) {
		return xml_fail(xml, "%s: \"%.40s\" is neither 0 nor 1", field->name, text);
	}
	memcpy(at, &value, sizeof(value));
	return 0;
}

static int add_word(struct xml *xml, const struct eni_field *field, const char *text, void *at)
{
	uint32_t value;

	for (size_t i = 0; field->words[i] != NULL; i++) {
		if (strcmp(field->words[i], text) == 0) {
			memcpy(&value, at, sizeof(value));
			value |= UINT32_C(1) << i;
			memcpy(at, &value, sizeof(value));
			return 0;
		}
	}
	return xml_fail(xml, "%s: unknown \"%.40s\"", field->name, text);
}

static int add_index(struct xml *xml, const struct eni_field *field, const char *text,
		     struct eni_list *list)
{
	const struct xml_range word = { 0, field->max };
	int64_t value = 0;
	int r = xml_number(xml, field->name, text, word, &value);

	if (r == 0 && list->count == ENI_LIMIT_SM_PDOS) {
		return xml_fail(xml, "%s: more than %d", field->name, ENI_LIMIT_SM_PDOS);
	}
	if (r == 0) {
		list->item[list->count++] = (uint16_t)value;
	}
	return r;
}

static int set_octets(struct xml *xml, const struct eni_field *field, const char *text,
		      struct eni_octets *octets)
{
	return xml_octets(xml, text, field->max, &octets->data, &octets->len);
}

static int set(struct xml *xml, const struct eni_field *field, const char *text, uint8_t *at)
{
	switch (field->kind) {
	case ENI_KIND_NUMBER:
	case ENI_KIND_HEX:
	case ENI_KIND_PATTERN:
	case ENI_KIND_SIGNED:
		return set_number(xml, field, text, at);
	case ENI_KIND_TRUTH:
		return set_truth(xml, field, text, at);
	case ENI_KIND_TEXT:
		xml_plain(text, (char *)at, field->max);
		return 0;
	case ENI_KIND_OCTETS:
		return set_octets(xml, field, text, (struct eni_octets *)(void *)at);
	case ENI_KIND_WORDS:
		return add_word(xml, field, text, at);
	case ENI_KIND_INDEXES:
		return add_index(xml, field, text, (struct eni_list *)(void *)at);
	}
	return -EINVAL;
}

int eni_field_set(struct xml *xml, enum eni_node node, size_t field, const char *text, void *base)
{
	const struct eni_table table = eni_table_of(node);
	uint32_t has;
	int r;

	assert(field < table.count && table.field != NULL);
	r = set(xml, &table.field[field], text, (uint8_t *)base + table.field[field].at);

	if (r == 0) {
		memcpy(&has, base, sizeof(has));
		has |= ENI_HAS(field);
		memcpy(base, &has, sizeof(has));
	}
	return r;
}
