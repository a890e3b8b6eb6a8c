/* SPDX-License-Identifier: MIT */
/* Shared by the files that know CoE mails. */
#ifndef MAILBOX_COE_INTERNAL_H
#define MAILBOX_COE_INTERNAL_H

#include "mailbox/mailbox.h"

enum coe_service {
	COE_EMERGENCY = 1,
	COE_SDO_REQUEST = 2,
	COE_SDO_RESPONSE = 3,
	COE_SDO_INFORMATION = 8,
};

enum { COE_HEADER_BYTES = 2, COE_SERVICE_SHIFT = 12 };

enum sdo_command {
	SDO_SPECIFIER = 0xe0, /* the three bits that say which command it is */
	SDO_DOWNLOAD = 0x20,
	SDO_DOWNLOADED = 0x60,
	SDO_DOWNLOAD_SEGMENT = 0x00,
	SDO_SEGMENT_DOWNLOADED = 0x20,
	SDO_UPLOAD = 0x40,
	SDO_UPLOADED = 0x40,
	SDO_UPLOAD_SEGMENT = 0x60,
	SDO_SEGMENT_UPLOADED = 0x00,
	SDO_ABORT = 0x80,
	SDO_COMPLETE_ACCESS = 0x10,
	SDO_TOGGLE = 0x10,
	SDO_EXPEDITED = 0x02,
	SDO_SIZE_INDICATED = 0x01,
	SDO_LAST_SEGMENT = 0x01,
	SDO_UNUSED_SHIFT = 1, /* in a segment */
	SDO_UNUSED_MASK = 0x07,
	SDO_EXPEDITED_SHIFT = 2,
};

/* Offsets in the data of an SDO mail, and lengths. */
enum sdo_layout {
	COMMAND_AT = 2,
	INDEX_AT = 3,
	SUBINDEX_AT = 5,
	DATA_AT = 6,
	SDO_BYTES = 10,
	EXPEDITED_BYTES = 4,
	SEGMENT_AT = 3,
	SEGMENT_MIN = 7, /* data of the shortest segment */
};

/* SDO information. */
enum information_layout {
	INFORMATION_OPCODE_AT = 2,
	INFORMATION_FRAGMENTS_AT = 4,
	INFORMATION_BODY_AT = 6,
	INFORMATION_OPCODE_MASK = 0x7f,
	INFORMATION_ERROR = 7, /* an opcode */
};

/** As the functions of struct mailbox_protocol; for COE_LIST, COE_OBJECT, COE_ENTRY. */
int coe_information_compose(struct mailbox_request *rq, uint8_t *data, size_t capacity);
int coe_information_received(struct mailbox_request *rq, const uint8_t *data, size_t len);

#endif
