/* SPDX-License-Identifier: MIT */
/*
 * The one description of the slave. The firmware checks the master's settings against it and
 * answers CoE from it; host/sii.c makes the EEPROM image and host/esi.c the ESI file from it.
 */
#ifndef FB1111_PICCOLO_DESCRIPTION_H
#define FB1111_PICCOLO_DESCRIPTION_H

#include "octet.h"

#define PICCOLO_VENDOR_ID UINT32_C(0x00000002)
#define PICCOLO_PRODUCT_CODE UINT32_C(0x04570862)
#define PICCOLO_REVISION UINT32_C(0x0258008d)
#define PICCOLO_SERIAL UINT32_C(0)
#define PICCOLO_DEVICE_TYPE UINT32_C(0x00001389) /* ETG.5001: 0x6000 inputs, 0x7000 outputs */

/* A slot of the flash, header included: sectors B to E of the F28069. */
#define PICCOLO_FLASH_OCTETS UINT32_C(131072)

#define PICCOLO_MIN_CYCLE_NS UINT32_C(100000)
#define PICCOLO_MAX_CYCLE_NS UINT32_C(1000000000)
/* SYNC0 edge to inputs in SM3: 28 SPI octets of 799.7 ns and the interrupt's entry. */
#define PICCOLO_COPY_NS UINT32_C(23000)

enum piccolo_size {
	PICCOLO_MAILBOX_OCTETS = 128,
	PICCOLO_OUTPUT_OCTETS = 9,
	PICCOLO_INPUT_OCTETS = 13,
	PICCOLO_EEPROM_OCTETS = 2048,
	PICCOLO_VERSION_OCTETS = 16,
	PICCOLO_IMAGE_HEADER_OCTETS = 32,
	PICCOLO_CONFIG_OCTETS = 14, /* EEPROM words 0 to 6; word 7 is their checksum */
	PICCOLO_SM_COUNT = 4,
	PICCOLO_FMMU_COUNT = 3,
	PICCOLO_DC_MODE_COUNT = 2,
	PICCOLO_RX_ENTRIES = 3,
	PICCOLO_TX_ENTRIES = 4
};

enum piccolo_sm_index {
	PICCOLO_SM_MAILBOX_OUT,
	PICCOLO_SM_MAILBOX_IN,
	PICCOLO_SM_OUTPUTS,
	PICCOLO_SM_INPUTS
};

/* Data types by their ETG.1000.6 / CANopen number. */
enum piccolo_type {
	PICCOLO_PADDING = 0x00,
	PICCOLO_BOOL = 0x01,
	PICCOLO_USINT = 0x05,
	PICCOLO_UINT = 0x06,
	PICCOLO_UDINT = 0x07,
	PICCOLO_STRING = 0x09,
	PICCOLO_ULINT = 0x1b
};

struct piccolo_entry {
	uint16_t index; /* 0: padding */
	octet_t subindex;
	octet_t bits;
	enum piccolo_type type;
	const char *name; /* NULL: padding */
};

struct piccolo_pdo {
	uint16_t index;
	octet_t sm;
	octet_t entry_count;
	const struct piccolo_entry *entries;
	const char *name;
};

struct piccolo_sm {
	uint16_t start;
	uint16_t length;
	octet_t control;  /* 0x0804 + 8n */
	octet_t type;     /* ETG.2010 and 0x1C00: 1 mailbox out, 2 in, 3 outputs, 4 inputs */
	const char *name; /* as ESI names it */
};

struct piccolo_fmmu {
	octet_t type; /* ETG.2010: 1 outputs, 2 inputs, 3 mailbox state */
	const char *name;
};

struct piccolo_dc_mode {
	const char *name;
	const char *text;
	uint16_t assign_activate; /* low octet to 0x0980, high to 0x0981 */
	octet_t sync0_factor;     /* SYNC0 period in bus cycles; 0: none */
};

struct piccolo_description {
	const char *vendor_name;
	const char *order; /* ESI type, SII order string */
	const char *name;
	const char *group;
	const char *group_name;
	const char *hardware_version;
	const char *software_version;
	octet_t config[PICCOLO_CONFIG_OCTETS];
	struct piccolo_sm sm[PICCOLO_SM_COUNT];
	struct piccolo_fmmu fmmu[PICCOLO_FMMU_COUNT];
	struct piccolo_pdo rx;
	struct piccolo_pdo tx;
	struct piccolo_dc_mode dc[PICCOLO_DC_MODE_COUNT];
};

extern const struct piccolo_description piccolo_description;

#endif
