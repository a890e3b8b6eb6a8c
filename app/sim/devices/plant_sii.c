/* SPDX-License-Identifier: MIT */
#include "devices/plant_sii.h"

#include <assert.h>
#include <string.h>

#include "base/bytes.h"
#include "devices/slave_application.h"
#include "wire/sii.h"

enum sii_byte {
	SII_PDI_CONTROL = 0x00,
	SII_ESC_CONFIG = 0x01,
	SII_SYNC_CONFIG = 0x03,
	SII_CHECKSUM = 0x0e,
	SII_VENDOR = 0x10,
	SII_PRODUCT = 0x14,
	SII_REVISION = 0x18,
	SII_SIZE = 0x7c,
	SII_VERSION = 0x7e,
};

/* No vendor has this number: nothing real is meant. */
enum identity { VENDOR = 0x0000ecda, PRODUCT = 0x00000001, REVISION = 0x00000001 };

enum plant {
	PDI_SPI = 0x05,
	DC_UNITS_ON = 0x0c,
	SYNC0_PIN_AND_EVENT = 0x0c, /* 0x0151 */
	OUTPUTS_AT = 0x1000,
	INPUTS_AT = 0x1100,
	OUTPUTS_CONTROL = 0x64, /* three buffers, written by the master, with watchdog */
	INPUTS_CONTROL = 0x20,
	REAL = 0x08, /* ETG.1020 base data type */
	REAL_BITS = 32,
	GENERAL_BYTES = 32,
	DC_MODE_BYTES = 24,
	ASSIGN_SYNC0 = 0x0300,
	KIBIT_OF_EEPROM = 4,
};

enum { STRING_NAME = 1, STRING_ACTUATOR, STRING_SENSOR, STRING_DC };

static const char *const strings[] = { "Plant (first order)", "actuator", "sensor", "DC-Synchron" };

struct writer {
	uint8_t *image;
	size_t pos;
	size_t body; /* of the open category */
};

static void put(struct writer *w, uint32_t value, size_t bytes)
{
	assert(w->pos + bytes <= PLANT_SII_BYTES);
	for (size_t i = 0; i < bytes; i++) {
		w->image[w->pos++] = (uint8_t)(value >> (8 * i));
	}
}

static void fill(struct writer *w, size_t end)
{
	while (w->pos < end) {
		put(w, 0, 1);
	}
}

static void begin(struct writer *w, enum sii_category category)
{
	put(w, (uint32_t)category, 4);
	w->body = w->pos;
}

static void end(struct writer *w)
{
	fill(w, w->pos + (w->pos - w->body) % 2);
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

static void put_sm(struct writer *w, uint16_t start, uint8_t control, enum slave_sm_type type)
{
	put(w, start, 2);
	put(w, PLANT_BYTES, 2);
	put(w, control, 2);
	put(w, 1, 1);
	put(w, (uint32_t)type, 1);
}

/* A PDO with one entry, REAL. */
static void put_pdo(struct writer *w, uint16_t pdo, uint16_t entry, uint8_t sm, uint8_t name)
{
	put(w, pdo, 2);
	put(w, 1, 1);
	put(w, sm, 1);
	put(w, 0, 1);
	put(w, name, 1);
	put(w, 0, 2);
	put(w, entry, 2);
	put(w, 1, 1);
	put(w, name, 1);
	put(w, REAL, 1);
	put(w, REAL_BITS, 1);
	put(w, 0, 2);
}

static void put_process_data(struct writer *w)
{
	begin(w, SII_CATEGORY_FMMU);
	put(w, 0x0201, 2); /* outputs, inputs */
	end(w);
	begin(w, SII_CATEGORY_SM);
	put_sm(w, OUTPUTS_AT, OUTPUTS_CONTROL, SLAVE_SM_OUTPUTS);
	put_sm(w, INPUTS_AT, INPUTS_CONTROL, SLAVE_SM_INPUTS);
	end(w);
	begin(w, SII_CATEGORY_TXPDO);
	put_pdo(w, 0x1a00, 0x6000, PLANT_SM_INPUTS, STRING_SENSOR);
	end(w);
	begin(w, SII_CATEGORY_RXPDO);
	put_pdo(w, 0x1600, 0x7000, PLANT_SM_OUTPUTS, STRING_ACTUATOR);
	end(w);
}

static void put_general(struct writer *w)
{
	begin(w, SII_CATEGORY_GENERAL);
	put(w, 0, 3); /* group, image, order */
	put(w, STRING_NAME, 1);
	fill(w, w->body + GENERAL_BYTES);
	end(w);
}

static void put_dc(struct writer *w)
{
	begin(w, SII_CATEGORY_DC);
	put(w, 0, 4); /* SYNC0: the master's cycle */
	put(w, 0, 4); /* shift */
	put(w, 0, 4); /* shift of SYNC1 */
	put(w, 0, 2); /* no SYNC1 */
	put(w, ASSIGN_SYNC0, 2);
	put(w, 0, 2); /* factor of SYNC0 */
	put(w, STRING_DC, 1);
	fill(w, w->body + DC_MODE_BYTES);
	end(w);
}

size_t plant_sii(uint8_t *image)
{
	struct writer w = { .image = image, .pos = SII_CATEGORIES_BYTE };

	memset(image, 0, PLANT_SII_BYTES);
	image[SII_PDI_CONTROL] = PDI_SPI;
	image[SII_ESC_CONFIG] = DC_UNITS_ON;
	image[SII_SYNC_CONFIG] = SYNC0_PIN_AND_EVENT;
	image[SII_CHECKSUM] = sii_checksum(image);
	put_le32(image + SII_VENDOR, VENDOR);
	put_le32(image + SII_PRODUCT, PRODUCT);
	put_le32(image + SII_REVISION, REVISION);
	put_le16(image + SII_SIZE, KIBIT_OF_EEPROM - 1);
	put_le16(image + SII_VERSION, 1);
	put_strings(&w);
	put_general(&w);
	put_process_data(&w);
	put_dc(&w);
	put(&w, SII_CATEGORY_END, 2);
	return w.pos;
}
