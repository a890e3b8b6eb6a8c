/* SPDX-License-Identifier: MIT */
/*
 * CoE (ETG.1000.6, 5.6): SDO upload and download (expedited, normal, segmented, complete access),
 * SDO information, emergencies. A request is submitted to the engine (mailbox.h) with protocol
 * &coe_protocol and the parameters here.
 */
#ifndef MAILBOX_COE_H
#define MAILBOX_COE_H

#include <stddef.h>
#include <stdint.h>

struct mailbox_protocol;

extern const struct mailbox_protocol coe_protocol;

enum coe_operation {
	COE_UPLOAD,   /* read index:subindex into the buffer */
	COE_DOWNLOAD, /* write the buffer */
	/* SDO information; the buffer takes what coe_..._get() below read */
	COE_LIST,
	COE_OBJECT,
	COE_ENTRY,
};

enum coe_access { COE_ACCESS_SINGLE, COE_ACCESS_COMPLETE };

enum coe_list_type {
	COE_LIST_LENGTHS = 0,
	COE_LIST_ALL = 1,
	COE_LIST_RXPDO = 2,
	COE_LIST_TXPDO = 3,
	COE_LIST_BACKUP = 4,
	COE_LIST_SETTINGS = 5,
};

/* Parameters of a request. */
struct coe_parameters {
	enum coe_operation operation;
	enum coe_access access; /* complete access: from subindex 0 or 1 on */
	uint16_t index;
	uint8_t subindex;
	enum coe_list_type list_type;
};

/* What a request remembers between two mails. */
struct coe_state {
	uint8_t toggle;
	uint8_t is_begun; /* the slave may have a transfer to abort */
	uint8_t is_segmented;
	uint8_t has_fragment;
	uint16_t fragments_left;
	uint32_t abort; /* that we send, instead of a general one */
	size_t in_mail; /* bytes of the buffer in the mail composed last */
};

enum coe_abort_code {
	COE_ABORT_TOGGLE = 0x05030000,
	COE_ABORT_TIMEOUT = 0x05040000,
	COE_ABORT_COMMAND = 0x05040001,
	COE_ABORT_MEMORY = 0x05040005,
	COE_ABORT_NO_OBJECT = 0x06020000,
	COE_ABORT_LENGTH = 0x06070010,
	COE_ABORT_GENERAL = 0x08000000,
};

struct coe_emergency {
	uint16_t code;
	uint8_t error_register;
	uint8_t data[5];
};

/** 1 and @ret if the CoE mail @data is an emergency; else 0. */
int coe_emergency_get(const uint8_t *data, size_t len, struct coe_emergency *ret);

enum { COE_NAME_BYTES = 64 };

struct coe_object {
	uint16_t index;
	uint16_t data_type;
	uint8_t subindex_max;
	uint8_t object_code; /* 7 variable, 8 array, 9 record */
	char name[COE_NAME_BYTES];
};

struct coe_entry {
	uint16_t index;
	uint8_t subindex;
	uint16_t data_type; /* ETG.1020 base data type */
	uint16_t bit_len;
	uint16_t access;
	uint32_t unit; /* wire/coe_unit.h; 0: none */
	char name[COE_NAME_BYTES];
};

/** What COE_OBJECT, COE_ENTRY read: 0 or -EPROTO (too short). */
int coe_object_get(const uint8_t *buffer, size_t len, struct coe_object *ret);
int coe_entry_get(const uint8_t *buffer, size_t len, struct coe_entry *ret);

#endif
