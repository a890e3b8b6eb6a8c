/* SPDX-License-Identifier: MIT */
/*
 * Servo drive profile over EtherCAT (SoE, ETG.1000.6 part 5.9; IEC 61800-7-304): parameters (IDN)
 * with elements, in one mail or in fragments. Bytes may be anything. Context: any, RT-safe.
 */
#ifndef WIRE_SOE_H
#define WIRE_SOE_H

#include <stddef.h>
#include <stdint.h>

enum { SOE_HEADER_BYTES = 4, SOE_ERROR_BYTES = 2, SOE_LIST_HEADER_BYTES = 4, SOE_DRIVES = 8 };

enum soe_operation {
	SOE_READ = 1,
	SOE_READ_RESPONSE = 2,
	SOE_WRITE = 3,
	SOE_WRITE_RESPONSE = 4,
	SOE_NOTIFICATION = 5,
	SOE_EMERGENCY = 6,
};

/* Elements, in the order in which they come. */
enum soe_element {
	SOE_ELEMENT_STATE = 0x01, /* data state: 2 bytes */
	SOE_ELEMENT_NAME = 0x02,  /* a list of characters */
	SOE_ELEMENT_ATTRIBUTE = 0x04,
	SOE_ELEMENT_UNIT = 0x08, /* a list of characters */
	SOE_ELEMENT_MIN = 0x10,
	SOE_ELEMENT_MAX = 0x20,
	SOE_ELEMENT_VALUE = 0x40, /* a list: current and largest length in bytes, 2 bytes each,
				     first */
	SOE_ELEMENT_DEFAULT = 0x80,
};

/* Bits 16 to 18 of the attribute: bytes of a value, and whether it is a list of such; 20 to 22: how
 * it is shown; 24 to 27: decimal places. */
enum soe_attribute {
	SOE_LENGTH_SHIFT = 16,
	SOE_LENGTH_MASK = 7,
	SOE_IS_COMMAND = 1 << 19,
	SOE_FORMAT_SHIFT = 20,
	SOE_FORMAT_MASK = 7,
	SOE_DECIMALS_SHIFT = 24,
	SOE_DECIMALS_MASK = 15,
};

enum soe_format {
	SOE_FORMAT_BINARY = 0,
	SOE_FORMAT_UNSIGNED = 1,
	SOE_FORMAT_SIGNED = 2,
	SOE_FORMAT_HEX = 3,
	SOE_FORMAT_TEXT = 4,
	SOE_FORMAT_IDN = 5,
	SOE_FORMAT_FLOAT = 6,
};

enum { SOE_IDN_TEXT_BYTES = 10 };

enum soe_length {
	SOE_LENGTH_2 = 1,
	SOE_LENGTH_4 = 2,
	SOE_LENGTH_8 = 3,
	SOE_LENGTH_LIST_1 = 4,
	SOE_LENGTH_LIST_2 = 5,
	SOE_LENGTH_LIST_4 = 6,
	SOE_LENGTH_LIST_8 = 7,
};

enum soe_error {
	SOE_ERROR_NONE = 0,
	SOE_ERROR_NO_IDN = 0x1001,
	SOE_ERROR_NO_ELEMENT = 0x1009,
	SOE_ERROR_TOO_SHORT = 0x7002,
	SOE_ERROR_TOO_LONG = 0x7003,
	SOE_ERROR_READ_ONLY = 0x7004,
	SOE_ERROR_BELOW_MIN = 0x7006,
	SOE_ERROR_ABOVE_MAX = 0x7007,
	SOE_ERROR_INVALID = 0x7008,
};

struct soe_message {
	uint8_t operation; /* enum soe_operation */
	uint8_t drive;     /* 0 to SOE_DRIVES - 1 */
	uint8_t is_error;  /* the body is an enum soe_error */
	uint8_t has_more;  /* fragments_left follow, idn is not known */
	uint8_t elements;  /* enum soe_element, ORed */
	uint16_t idn;
	uint16_t fragments_left;
	const uint8_t *body;
	size_t body_len;
};

/** Take @data apart. 0; -EBADMSG: no SoE message, or an error without its code. */
int soe_parse(const uint8_t *data, size_t data_len, struct soe_message *ret);
/** Its length; 0: it does not fit. */
size_t soe_format(const struct soe_message *m, uint8_t *data, size_t capacity);

/** Text of an error code; "unknown error" for one that is not listed. */
const char *soe_error_to_str(uint32_t code);
/** "S-0-0017", "P-0-0001". */
void soe_idn_format(uint16_t idn, char ret_text[SOE_IDN_TEXT_BYTES]);
/** An IDN of that form, or a number up to 65535, in hex with 0x. 0 or -EINVAL. */
int soe_idn_parse(const char *text, uint16_t *ret_idn);
/** Bytes of a value by its attribute; of one item of a list. 0: the attribute gives none. */
size_t soe_value_bytes(uint32_t attribute);
/** 1: the value is a list. */
int soe_is_list(uint32_t attribute);

#endif
