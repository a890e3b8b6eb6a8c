/* SPDX-License-Identifier: MIT */
/*
 * The elements of an ENI file and the one table of their fields, by which they are read and
 * written. Context: any.
 */
#ifndef ENI_FIELDS_H
#define ENI_FIELDS_H

#include <stddef.h>
#include <stdint.h>

#include "xml/value.h"

enum eni_node {
	ENI_NODE_ROOT,  /* the document */
	ENI_NODE_OTHER, /* passed over, with all that is in it */
	ENI_NODE_FIELD, /* a number or text of what is around it */
	ENI_NODE_FILE,
	ENI_NODE_CONFIG,
	ENI_NODE_MASTER,
	ENI_NODE_MASTER_INFO,
	ENI_NODE_MAILBOX_STATES,
	ENI_NODE_INITS,
	ENI_NODE_INIT,
	ENI_NODE_VALIDATE,
	ENI_NODE_SLAVE,
	ENI_NODE_INFO,
	ENI_NODE_IDENTIFICATION,
	ENI_NODE_PROCESS_DATA,
	ENI_NODE_SEND,
	ENI_NODE_RECV,
	ENI_NODE_SM,
	ENI_NODE_RX_PDO,
	ENI_NODE_TX_PDO,
	ENI_NODE_ENTRY,
	ENI_NODE_MAILBOX,
	ENI_NODE_MAILBOX_SEND,
	ENI_NODE_MAILBOX_RECV,
	ENI_NODE_BOOT,
	ENI_NODE_BOOT_SEND,
	ENI_NODE_BOOT_RECV,
	ENI_NODE_COE,
	ENI_NODE_COE_INITS,
	ENI_NODE_COE_INIT,
	ENI_NODE_PORT,
	ENI_NODE_DC,
	ENI_NODE_CYCLIC,
	ENI_NODE_FRAME,
	ENI_NODE_CMD,
	ENI_NODE_IMAGE,
	ENI_NODE_INPUTS,
	ENI_NODE_OUTPUTS,
	ENI_NODE_VARIABLE,
};

enum eni_kind {
	ENI_KIND_NUMBER, /* uint32_t; hexadecimal in ENI_KIND_HEX */
	ENI_KIND_HEX,
	ENI_KIND_PATTERN, /* uint32_t whose top bit may be a sign */
	ENI_KIND_SIGNED,  /* int32_t */
	ENI_KIND_TRUTH,
	ENI_KIND_TEXT,
	ENI_KIND_OCTETS,
	ENI_KIND_WORDS,   /* uint32_t: a bit for each word that is there */
	ENI_KIND_INDEXES, /* struct eni_list */
};

struct eni_field {
	const char *name; /* "@Sm": an attribute */
	enum eni_kind kind;
	uint32_t max; /* of a number; bytes of a text */
	size_t at;
	const char *const *words; /* of ENI_KIND_WORDS; NULL ends them */
};

/* The fields of an element; field n has bit n of its @has. */
struct eni_table {
	const struct eni_field *field;
	size_t count;
};

/* Fields that other code looks for: their places in their tables. */
enum { ENI_INFO_PHYS_ADDR = 1, ENI_INFO_REVISION = 6, ENI_INFO_SERIAL = 7 };
enum { ENI_PDO_SM = 2 };
enum {
	ENI_INIT_TRANSITIONS = 0,
	ENI_INIT_COMMENT = 2,
	ENI_INIT_CMD = 4,
	ENI_INIT_ADP,
	ENI_INIT_ADO,
	ENI_INIT_ADDR,
	ENI_INIT_DATA,
	ENI_INIT_DATA_LEN,
	ENI_INIT_CNT,
	ENI_INIT_RETRIES,
	ENI_INIT_TIMEOUT,
};
enum {
	ENI_CMD_STATES,
	ENI_CMD_COMMENT,
	ENI_CMD_CMD,
	ENI_CMD_ADP,
	ENI_CMD_ADO,
	ENI_CMD_ADDR,
	ENI_CMD_DATA,
	ENI_CMD_DATA_LEN,
	ENI_CMD_CNT,
	ENI_CMD_INPUT_OFFS,
	ENI_CMD_OUTPUT_OFFS,
};
enum { ENI_SM_BYTES = 3 };
enum { ENI_DC_CYCLE0 = 2, ENI_DC_CYCLE1, ENI_DC_SHIFT };
enum { ENI_AREA_POLL_TIME = 2, ENI_AREA_STATUS_BIT };
enum { ENI_CYCLIC_CYCLE = 1 };

#define ENI_HAS(bit) (UINT32_C(1) << (bit))

/** Element @name in @parent; a field of @parent: ENI_NODE_FIELD with its place. */
enum eni_node eni_node_find(enum eni_node parent, const char *name, size_t *ret_field);
/** Name of the element; "Sm" stands for Sm0 to Sm15. */
const char *eni_node_name(enum eni_node node);
struct eni_table eni_table_of(enum eni_node node);

/** All fields of @base, which is a @node, are there but those of the bits @except. */
void eni_has_all(enum eni_node node, void *base, uint32_t except);

/** Set the field of structure @base from @text, and its bit in @base. 0, or -EBADMSG with a line.
 */
int eni_field_set(struct xml *xml, enum eni_node node, size_t field, const char *text, void *base);

#endif
