/* SPDX-License-Identifier: MIT */
/*
 * Values of CoE objects as people write them: the basic data types of ETG.1000.6, table 64, that
 * fit into 64 bits, between text and little-endian bits. Context: any.
 */
#ifndef CONFIG_SDO_VALUE_H
#define CONFIG_SDO_VALUE_H

#include <stddef.h>
#include <stdint.h>

enum sdo_type {
	SDO_BOOL,
	SDO_SINT,
	SDO_INT,
	SDO_DINT,
	SDO_LINT,
	SDO_USINT,
	SDO_UINT,
	SDO_UDINT,
	SDO_ULINT,
	SDO_REAL,
	SDO_LREAL,
	SDO_TYPES,
};

/* All of them, in the form of OPTION_WORD. */
#define SDO_TYPE_WORDS "BOOL|SINT|INT|DINT|LINT|USINT|UINT|UDINT|ULINT|REAL|LREAL"

/** The type named @name, upper or lower case; -ENOENT. */
int sdo_type_find(const char *name);
const char *sdo_type_to_str(enum sdo_type type);
unsigned sdo_type_bytes(enum sdo_type type);

/**
 * Bits of @text as @type: decimal, 0x hex (the bits themselves, also of a signed type), a float for
 * REAL, true/false/on/off/0/1 for BOOL. 0, -EINVAL, -ERANGE; ret untouched on failure.
 */
int sdo_value_parse(enum sdo_type type, const char *text, uint64_t *ret_bits);

/** Text of @bits. Returns its length as snprintf does. */
int sdo_value_format(enum sdo_type type, uint64_t bits, char *buf, size_t buf_len);

#endif
