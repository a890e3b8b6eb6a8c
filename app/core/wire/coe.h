/* SPDX-License-Identifier: MIT */
/*
 * CANopen over EtherCAT (CoE, ETG.1000.6 part 5.6): the CoE header, then an SDO, SDO information or
 * an emergency. Offsets count from the CoE header. Context: any, RT-safe.
 */
#ifndef WIRE_COE_H
#define WIRE_COE_H

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
	SDO_UNUSED_SHIFT = 1, /* in a segment: bytes at its end that are none */
	SDO_UNUSED_MASK = 0x07,
	SDO_EXPEDITED_SHIFT = 2, /* the same in an expedited SDO */
	SDO_EXPEDITED_MASK = 0x03,
};

enum sdo_layout {
	SDO_COMMAND_AT = 2,
	SDO_INDEX_AT = 3,
	SDO_SUBINDEX_AT = 5,
	SDO_DATA_AT = 6, /* expedited data, or the length of what follows */
	SDO_BYTES = 10,
	SDO_EXPEDITED_BYTES = 4,
	SDO_SEGMENT_AT = 3,
	SDO_SEGMENT_MIN = 7, /* data of the shortest segment */
};

enum sdo_information_opcode {
	SDO_GET_LIST = 1,
	SDO_LIST = 2,
	SDO_GET_OBJECT = 3,
	SDO_OBJECT = 4,
	SDO_GET_ENTRY = 5,
	SDO_ENTRY = 6,
	SDO_INFORMATION_ERROR = 7,
	SDO_INFORMATION_OPCODE_MASK = 0x7f, /* the bit above: not the last fragment */
};

/* Optional values of an entry: asked for, and in the answer those that are sent. */
enum sdo_value_info {
	SDO_VALUE_ACCESS = 0x01,
	SDO_VALUE_CATEGORY = 0x02,
	SDO_VALUE_MAPPING = 0x04,
	SDO_VALUE_UNIT = 0x08,
	SDO_VALUE_DEFAULT = 0x10,
	SDO_VALUE_MIN = 0x20,
	SDO_VALUE_MAX = 0x40,
};

enum sdo_information_layout {
	SDO_INFORMATION_OPCODE_AT = 2,
	SDO_INFORMATION_FRAGMENTS_AT = 4, /* fragments left */
	SDO_INFORMATION_BODY_AT = 6,
	/* Lengths of a body: of requests, and of answers up to the name. */
	SDO_GET_OBJECT_BYTES = 2, /* of GET_LIST too */
	SDO_GET_ENTRY_BYTES = 4,
	SDO_OBJECT_BYTES = 6,
	SDO_ENTRY_BYTES = 10,
	SDO_ENTRY_UNIT_BYTES = 4, /* between them, where it is sent */
};

#endif
