/* SPDX-License-Identifier: MIT */
/*
 * A slave's EEPROM (SII, ETG.1000.6 and ETG.2010): identity words, then categories. Bytes may be
 * anything: every access is bounded, a category that runs past the end ends the walk (T31).
 * Context: any; nothing allocates.
 */
#ifndef WIRE_SII_H
#define WIRE_SII_H

#include <stddef.h>
#include <stdint.h>

enum sii_category {
	SII_CATEGORY_STRINGS = 10,
	SII_CATEGORY_GENERAL = 30,
	SII_CATEGORY_FMMU = 40,
	SII_CATEGORY_SM = 41,
	SII_CATEGORY_TXPDO = 50,
	SII_CATEGORY_RXPDO = 51,
	SII_CATEGORY_DC = 60,
	SII_CATEGORY_END = 0xffff,
};

enum sii_limits {
	SII_ALIAS_BYTE = 0x08,
	SII_CHECKSUM_BYTE = 0x0e, /* word 7, low byte */
	SII_VENDOR_BYTE = 0x10,
	SII_PRODUCT_BYTE = 0x14,
	SII_REVISION_BYTE = 0x18,
	SII_SERIAL_BYTE = 0x1c,
	SII_SIZE_BYTE = 0x7c,
	SII_CATEGORIES_BYTE = 0x80,   /* offset of the first category header */
	SII_UNSTATED_BYTES = 4096,    /* read where the size word gives no size */
	SII_LIMIT_BYTES = 512 * 1024, /* the largest EEPROM that an ESC addresses: 4 Mbit */
	SII_LIMIT_SM = 16,
	SII_LIMIT_FMMU = 16,
	SII_LIMIT_PDO = 128,
	SII_LIMIT_ENTRIES = 1024,
	SII_LIMIT_DC_MODES = 8,
	SII_NAME_BYTES = 64,
};

enum sii_mailbox_protocol {
	SII_MAILBOX_AOE = 0x01,
	SII_MAILBOX_EOE = 0x02,
	SII_MAILBOX_COE = 0x04,
	SII_MAILBOX_FOE = 0x08,
	SII_MAILBOX_SOE = 0x10,
	SII_MAILBOX_VOE = 0x20,
};

enum sii_general_flag {
	SII_GENERAL_SAFEOP = 0x01,
	SII_GENERAL_NOT_LRW = 0x02, /* use LRD and LWR instead */
};

struct sii_sm {
	uint16_t start;
	uint16_t len;
	uint8_t control;
	uint8_t enable;
	uint8_t type; /* 1 mailbox out, 2 mailbox in, 3 outputs, 4 inputs */
};

struct sii_entry {
	uint16_t index;
	uint8_t subindex;
	uint8_t bit_len;
	uint8_t data_type; /* ETG.1020 base data type */
	uint8_t name;      /* string number */
};

struct sii_pdo {
	uint16_t index;
	uint8_t sm;    /* 0xff: not assigned by default */
	uint8_t is_tx; /* TxPDO: the slave's, inputs of the master */
	uint8_t name;
	uint16_t first_entry;
	uint16_t entry_count;
	uint32_t bits;
};

/*
 * An operation mode of the DC category (ETG.2010 table 16). The first one is the default of the
 * vendor's description.
 */
struct sii_dc_mode {
	uint32_t sync0_cycle_ns; /* 0: from the master's cycle, by sync0_factor */
	int32_t sync0_shift_ns;
	int32_t sync1_shift_ns;
	int16_t sync1_factor;     /* SYNC1 cycle in SYNC0 cycles; 0: after each SYNC0 */
	uint16_t assign_activate; /* 0x0980 in the low byte, 0x0981 in the high byte */
	int16_t sync0_factor;     /* > 0: times the master's cycle; < 0: a fraction of it */
	uint8_t name;             /* string number */
};

/* All of an image that anybody here needs. */
struct sii {
	uint16_t pdi_control;
	uint16_t alias;
	uint32_t vendor;
	uint32_t product;
	uint32_t revision;
	uint32_t serial;
	uint16_t mailbox_out_start;
	uint16_t mailbox_out_len;
	uint16_t mailbox_in_start;
	uint16_t mailbox_in_len;
	uint16_t mailbox_protocols; /* enum sii_mailbox_protocol */
	/* Mailboxes of state BOOT; length 0: none. */
	uint16_t boot_out_start;
	uint16_t boot_out_len;
	uint16_t boot_in_start;
	uint16_t boot_in_len;
	uint32_t size_bytes;
	uint8_t coe_details;
	uint8_t foe_details;
	uint8_t eoe_details;
	uint8_t soe_channels;
	int16_t ebus_ma;
	uint8_t general_flags; /* enum sii_general_flag */
	uint8_t group_name;    /* string numbers */
	uint8_t order_name;
	uint8_t device_name;
	uint8_t has_general;
	struct sii_sm sm[SII_LIMIT_SM];
	size_t sm_count;
	uint8_t fmmu[SII_LIMIT_FMMU]; /* 1 outputs, 2 inputs, 3 mailbox state */
	size_t fmmu_count;
	struct sii_pdo pdo[SII_LIMIT_PDO];
	size_t pdo_count;
	struct sii_entry entry[SII_LIMIT_ENTRIES];
	size_t entry_count;
	struct sii_dc_mode dc_mode[SII_LIMIT_DC_MODES];
	size_t dc_mode_count;
};

/**
 * The first category of kind @wanted. 0 and where its body is; -ENOENT; -EBADMSG: the walk ran into
 * a category past the end of the image.
 */
int sii_find_category(const uint8_t *image, size_t image_bytes, uint16_t wanted, size_t *ret_offset,
		      size_t *ret_bytes);

/**
 * Parse an image. 0; -EBADMSG with one line in @error if it is too short, blank, or a category is
 * damaged. On failure @ret holds what precedes the damage.
 */
int sii_parse(const uint8_t *image, size_t image_bytes, struct sii *ret, char *error,
	      size_t error_bytes);

/** String @number (1-based) as text, unprintable bytes as '_'; "" for 0 or one that is not there.
 */
void sii_text(const uint8_t *image, size_t image_bytes, unsigned number,
	      char ret_text[SII_NAME_BYTES]);

/** CRC-8 over words 0 to 6, which is stored in word 7 (ETG.2010). */
uint8_t sii_checksum(const uint8_t *image);
/** 1 if word 7 is that checksum, or 0x88a4, which switches the check off in the ESC (ET1100 data
 * sheet). */
int sii_is_checksum_right(const uint8_t *image);

/**
 * Bytes that the size word (0x3e) of the header @image gives to the EEPROM. SII_UNSTATED_BYTES
 * where it is blank or leaves no room for categories; at most SII_LIMIT_BYTES.
 */
size_t sii_stated_bytes(const uint8_t *image);

#endif
