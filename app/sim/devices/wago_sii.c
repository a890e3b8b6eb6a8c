/* SPDX-License-Identifier: MIT */
/* The coupler's EEPROM: identity, mailbox, SyncManagers, FMMUs; nothing of its modules. */
#include <assert.h>
#include <string.h>

#include "base/bytes.h"
#include "devices/slave_application.h"
#include "devices/wago_node.h"

enum sii_byte {
	SII_PDI_CONTROL = 0x00,
	SII_ESC_CONFIG = 0x01,
	SII_SYNC_CONFIG = 0x03,
	SII_CHECKSUM = 0x0e,
	SII_VENDOR = 0x10,
	SII_PRODUCT = 0x14,
	SII_REVISION = 0x18,
	SII_MAILBOX = 0x30, /* bootstrap's stands before it, and stays 0 */
	SII_PROTOCOLS = 0x38,
	SII_SIZE = 0x7c,
	SII_VERSION = 0x7e,
};

enum coupler {
	PDI_16_BIT = 0x08,
	DC_UNITS_ON = 0x0c,
	SYNC0_PIN_AND_EVENT = 0x0c, /* an output, and an AL event */
	COE_DETAILS = 0x33,         /* SDO, information, upload at start, complete access */
	MAILBOX_BYTES_EACH = 512,
	MAILBOX_OUT = 0x1000,
	MAILBOX_IN = 0x1400,
	OUTPUTS = 0x1800,
	INPUTS = 0x2400,
	ASSIGN_SYNC0 = 0x0300,
	GENERAL_BYTES = 32,
	DC_MODE_BYTES = 24,
	KIBIT_OF_EEPROM = 16,
};

enum { STRING_NAME = 1, STRING_ORDER = 2, STRING_GROUP = 3, STRING_FREE = 4, STRING_DC = 5 };

static const char *const strings[] = { "WAGO Series 750 Bus Coupler", "750-354", "Couplers",
				       "SM-Synchron", "DC-Synchron" };

struct writer {
	uint8_t *image;
	size_t pos;
	size_t body; /* of the open category */
};

static void put(struct writer *w, uint32_t value, size_t bytes)
{
	assert(w->pos + bytes <= WAGO_SII_BYTES);
	for (size_t i = 0; i < bytes; i++) {
		w->image[w->pos++] = (uint8_t)(value >> (8 * i));
	}
}

static void begin(struct writer *w, enum sii_category category)
{
	put(w, (uint32_t)category, 4);
	w->body = w->pos;
}

static void end(struct writer *w)
{
	if ((w->pos - w->body) % 2 != 0) {
		put(w, 0, 1);
	}
	put_le16(w->image + w->body - 2, (uint16_t)((w->pos - w->body) / 2));
}

static void put_strings(struct writer *w)
{
	const size_t count = sizeof(strings) / sizeof(strings[0]);

	begin(w, SII_CATEGORY_STRINGS);
	put(w, (uint32_t)count, 1);
	for (size_t i = 0; i < count; i++) {
		put(w, (uint32_t)strlen(strings[i]), 1);
		for (const char *c = strings[i]; *c != '\0'; c++) {
			put(w, (uint8_t)*c, 1);
		}
	}
	end(w);
}

static void put_general(struct writer *w)
{
	size_t start;

	begin(w, SII_CATEGORY_GENERAL);
	start = w->pos;
	put(w, STRING_GROUP, 1);
	put(w, 0, 1); /* no image */
	put(w, STRING_ORDER, 1);
	put(w, STRING_NAME, 1);
	put(w, 0, 1);
	put(w, COE_DETAILS, 1);
	while (w->pos < start + GENERAL_BYTES) {
		put(w, 0, 1);
	}
	end(w);
}

static void put_sm(struct writer *w, uint16_t start, uint16_t len, uint8_t control,
		   enum slave_sm_type type)
{
	put(w, start, 2);
	put(w, len, 2);
	put(w, control, 2);
	put(w, 1, 1);
	put(w, (uint32_t)type, 1);
}

static void put_channels(struct writer *w)
{
	begin(w, SII_CATEGORY_FMMU);
	put(w, 0x00030201, 4); /* outputs, inputs, mailbox state, unused */
	end(w);
	begin(w, SII_CATEGORY_SM);
	put_sm(w, MAILBOX_OUT, MAILBOX_BYTES_EACH, 0x26, SLAVE_SM_MAILBOX_OUT);
	put_sm(w, MAILBOX_IN, MAILBOX_BYTES_EACH, 0x22, SLAVE_SM_MAILBOX_IN);
	/* How long they are depends on the node, and is said by CoE. */
	put_sm(w, OUTPUTS, 0, 0x64, SLAVE_SM_OUTPUTS);
	put_sm(w, INPUTS, 0, 0x00, SLAVE_SM_INPUTS);
	end(w);
}

static void put_dc_mode(struct writer *w, uint16_t assign_activate, uint8_t name)
{
	size_t start = w->pos;

	put(w, 0, 4); /* SYNC0: the master's cycle */
	put(w, 0, 4); /* shift */
	put(w, 0, 4); /* shift of SYNC1 */
	put(w, 0, 2); /* no SYNC1 */
	put(w, assign_activate, 2);
	put(w, 0, 2); /* factor of SYNC0 */
	put(w, name, 1);
	while (w->pos < start + DC_MODE_BYTES) {
		put(w, 0, 1);
	}
}

static void put_words(uint8_t *image)
{
	image[SII_PDI_CONTROL] = PDI_16_BIT;
	image[SII_ESC_CONFIG] = DC_UNITS_ON;
	image[SII_SYNC_CONFIG] = SYNC0_PIN_AND_EVENT;
	image[SII_CHECKSUM] = sii_checksum(image);
	put_le32(image + SII_VENDOR, WAGO_VENDOR);
	put_le32(image + SII_PRODUCT, WAGO_PRODUCT);
	put_le32(image + SII_REVISION, WAGO_REVISION);
	put_le16(image + SII_MAILBOX, MAILBOX_OUT);
	put_le16(image + SII_MAILBOX + 2, MAILBOX_BYTES_EACH);
	put_le16(image + SII_MAILBOX + 4, MAILBOX_IN);
	put_le16(image + SII_MAILBOX + 6, MAILBOX_BYTES_EACH);
	put_le16(image + SII_PROTOCOLS, SII_MAILBOX_COE);
	put_le16(image + SII_SIZE, KIBIT_OF_EEPROM - 1);
	put_le16(image + SII_VERSION, 1);
}

size_t wago_sii(uint8_t *image)
{
	struct writer w = { .image = image, .pos = SII_CATEGORIES_BYTE };

	memset(image, 0, WAGO_SII_BYTES);
	put_words(image);
	put_strings(&w);
	put_general(&w);
	put_channels(&w);
	begin(&w, SII_CATEGORY_DC);
	put_dc_mode(&w, 0, STRING_FREE);
	put_dc_mode(&w, ASSIGN_SYNC0, STRING_DC);
	end(&w);
	put(&w, SII_CATEGORY_END, 2);
	return w.pos;
}
