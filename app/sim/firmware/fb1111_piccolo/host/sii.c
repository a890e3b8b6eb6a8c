/* SPDX-License-Identifier: MIT */
#include "sii.h"

#include <assert.h>
#include <string.h>

#include "../description.h"

enum sii_offset {
	SII_CHECKSUM = 0x0e,
	SII_VENDOR = 0x10,
	SII_PRODUCT = 0x14,
	SII_REVISION = 0x18,
	SII_SERIAL = 0x1c,
	SII_BOOT_RECEIVE = 0x28, /* offset 2, size 2 */
	SII_BOOT_SEND = 0x2c,
	SII_MAILBOX_RECEIVE = 0x30,
	SII_MAILBOX_SEND = 0x34,
	SII_MAILBOX_PROTOCOLS = 0x38,
	SII_SIZE = 0x7c, /* Kibit - 1 */
	SII_VERSION = 0x7e,
	SII_CATEGORIES = 0x80,
};

enum sii_category {
	CATEGORY_STRINGS = 10,
	CATEGORY_GENERAL = 30,
	CATEGORY_FMMU = 40,
	CATEGORY_SM = 41,
	CATEGORY_TXPDO = 50,
	CATEGORY_RXPDO = 51,
	CATEGORY_DC = 60,
};

enum {
	PROTOCOL_COE = 0x0004,
	PROTOCOL_FOE = 0x0008,
	HAS_FOE = 1,
	COE_SDO = 0x01, /* and neither information service nor complete access */
	PORTS_MII_MII = 0x0011,
	PDO_FIXED_MANDATORY = 0x0011,
	SM_ENABLE = 0x01,
	GENERAL_BYTES = 32,
	DC_BYTES = 24,
	STRINGS_MAX = 32,
};

struct strings {
	const char *text[STRINGS_MAX];
	uint8_t count;
};

struct image {
	uint8_t *bytes;
	size_t pos;
	size_t category; /* start of the open category's body */
	struct strings strings;
};

static void put8(struct image *im, unsigned v)
{
	assert(im->pos < PICCOLO_EEPROM_OCTETS);
	im->bytes[im->pos++] = (uint8_t)v;
}

static void put16(struct image *im, unsigned v)
{
	put8(im, v & 0xffu);
	put8(im, v >> 8 & 0xffu);
}

static void put32(struct image *im, uint32_t v)
{
	put16(im, v & 0xffffu);
	put16(im, v >> 16);
}

static void category_begin(struct image *im, enum sii_category type)
{
	put16(im, (unsigned)type);
	put16(im, 0);
	im->category = im->pos;
}

/* Categories are counted in words; an odd last byte is padded. */
static void category_end(struct image *im)
{
	if ((im->pos - im->category) % 2 != 0) {
		put8(im, 0);
	}
	octets_put16(im->bytes + im->category - 2, (uint16_t)((im->pos - im->category) / 2));
}

/* --- strings: numbered from 1 in the order of first use, 0 is no string --- */

static uint8_t string_index(struct image *im, const char *text)
{
	struct strings *s = &im->strings;

	if (text == NULL) {
		return 0;
	}
	for (uint8_t i = 0; i < s->count; i++) {
		if (strcmp(s->text[i], text) == 0) {
			return (uint8_t)(i + 1u);
		}
	}
	assert(s->count < STRINGS_MAX);
	s->text[s->count++] = text;
	return s->count;
}

static void collect_pdo_strings(struct image *im, const struct piccolo_pdo *pdo)
{
	string_index(im, pdo->name);
	for (unsigned i = 0; i < pdo->entry_count; i++) {
		string_index(im, pdo->entries[i].name);
	}
}

static void put_strings(struct image *im)
{
	const struct piccolo_description *d = &piccolo_description;

	string_index(im, d->order);
	string_index(im, d->group);
	string_index(im, d->name);
	collect_pdo_strings(im, &d->tx);
	collect_pdo_strings(im, &d->rx);
	for (unsigned i = 0; i < PICCOLO_DC_MODE_COUNT; i++) {
		string_index(im, d->dc[i].name);
		string_index(im, d->dc[i].text);
	}

	category_begin(im, CATEGORY_STRINGS);
	put8(im, im->strings.count);
	for (unsigned i = 0; i < im->strings.count; i++) {
		const char *text = im->strings.text[i];

		put8(im, (unsigned)strlen(text));
		while (*text != '\0') {
			put8(im, (unsigned char)*text++);
		}
	}
	category_end(im);
}

/* --- the other categories --- */

static void put_general(struct image *im)
{
	const struct piccolo_description *d = &piccolo_description;
	size_t start;

	category_begin(im, CATEGORY_GENERAL);
	start = im->pos;
	put8(im, string_index(im, d->group));
	put8(im, 0); /* no image */
	put8(im, string_index(im, d->order));
	put8(im, string_index(im, d->name));
	put8(im, 0);
	put8(im, COE_SDO);
	put8(im, HAS_FOE);
	for (unsigned i = 0; i < 5; i++) { /* EoE, three reserved, flags: none */
		put8(im, 0);
	}
	put16(im, 0); /* E-bus current */
	put16(im, string_index(im, d->group));
	put16(im, PORTS_MII_MII);
	while (im->pos < start + GENERAL_BYTES) {
		put8(im, 0);
	}
	category_end(im);
}

static void put_fmmu(struct image *im)
{
	category_begin(im, CATEGORY_FMMU);
	for (unsigned i = 0; i < PICCOLO_FMMU_COUNT; i++) {
		put8(im, piccolo_description.fmmu[i].type);
	}
	category_end(im);
}

static void put_sm(struct image *im)
{
	category_begin(im, CATEGORY_SM);
	for (unsigned i = 0; i < PICCOLO_SM_COUNT; i++) {
		const struct piccolo_sm *sm = &piccolo_description.sm[i];

		put16(im, sm->start);
		put16(im, sm->length);
		put8(im, sm->control);
		put8(im, 0); /* status */
		put8(im, SM_ENABLE);
		put8(im, sm->type);
	}
	category_end(im);
}

static void put_pdo(struct image *im, enum sii_category category, const struct piccolo_pdo *pdo)
{
	category_begin(im, category);
	put16(im, pdo->index);
	put8(im, pdo->entry_count);
	put8(im, pdo->sm);
	put8(im, 0); /* synchronisation */
	put8(im, string_index(im, pdo->name));
	put16(im, PDO_FIXED_MANDATORY);
	for (unsigned i = 0; i < pdo->entry_count; i++) {
		const struct piccolo_entry *e = &pdo->entries[i];

		put16(im, e->index);
		put8(im, e->subindex);
		put8(im, string_index(im, e->name));
		put8(im, (unsigned)e->type);
		put8(im, e->bits);
		put16(im, 0);
	}
	category_end(im);
}

static void put_dc(struct image *im)
{
	category_begin(im, CATEGORY_DC);
	for (unsigned i = 0; i < PICCOLO_DC_MODE_COUNT; i++) {
		const struct piccolo_dc_mode *mode = &piccolo_description.dc[i];
		size_t start = im->pos;

		put32(im, 0); /* SYNC0 cycle time: a multiple of the bus cycle */
		put32(im, 0); /* shift */
		put32(im, 0);
		put16(im, 0); /* SYNC1 */
		put16(im, mode->assign_activate);
		put16(im, mode->sync0_factor);
		put8(im, string_index(im, mode->name));
		put8(im, string_index(im, mode->text));
		while (im->pos < start + DC_BYTES) {
			put8(im, 0);
		}
	}
	category_end(im);
}

static void put_mailbox(uint8_t *at, const struct piccolo_sm *sm)
{
	octets_put16(at, sm->start);
	octets_put16(at + 2, sm->length);
}

static void put_fixed(uint8_t *bytes)
{
	const struct piccolo_description *d = &piccolo_description;

	memset(bytes, 0, SII_CATEGORIES);
	memcpy(bytes, d->config, PICCOLO_CONFIG_OCTETS);
	bytes[SII_CHECKSUM] = fb1111_piccolo_sii_checksum(bytes, PICCOLO_CONFIG_OCTETS);
	octets_put32(bytes + SII_VENDOR, PICCOLO_VENDOR_ID);
	octets_put32(bytes + SII_PRODUCT, PICCOLO_PRODUCT_CODE);
	octets_put32(bytes + SII_REVISION, PICCOLO_REVISION);
	octets_put32(bytes + SII_SERIAL, PICCOLO_SERIAL);
	put_mailbox(bytes + SII_BOOT_RECEIVE, &d->sm[PICCOLO_SM_MAILBOX_OUT]);
	put_mailbox(bytes + SII_BOOT_SEND, &d->sm[PICCOLO_SM_MAILBOX_IN]);
	put_mailbox(bytes + SII_MAILBOX_RECEIVE, &d->sm[PICCOLO_SM_MAILBOX_OUT]);
	put_mailbox(bytes + SII_MAILBOX_SEND, &d->sm[PICCOLO_SM_MAILBOX_IN]);
	octets_put16(bytes + SII_MAILBOX_PROTOCOLS, PROTOCOL_COE | PROTOCOL_FOE);
	octets_put16(bytes + SII_SIZE, PICCOLO_EEPROM_OCTETS * 8 / 1024 - 1);
	octets_put16(bytes + SII_VERSION, 1);
}

uint8_t fb1111_piccolo_sii_checksum(const uint8_t *config, size_t len)
{
	unsigned crc = 0xff;

	for (size_t i = 0; i < len; i++) {
		crc ^= config[i];
		for (unsigned bit = 0; bit < 8; bit++) {
			crc = (crc << 1 ^ ((crc & 0x80u) ? 0x07u : 0u)) & 0xffu;
		}
	}
	return (uint8_t)crc;
}

size_t fb1111_piccolo_sii(uint8_t *buf, size_t cap)
{
	struct image im = { .bytes = buf, .pos = SII_CATEGORIES };

	if (cap < PICCOLO_EEPROM_OCTETS) {
		return 0;
	}
	memset(buf, 0xff, PICCOLO_EEPROM_OCTETS);
	put_fixed(buf);
	put_strings(&im);
	put_general(&im);
	put_fmmu(&im);
	put_sm(&im);
	put_pdo(&im, CATEGORY_TXPDO, &piccolo_description.tx);
	put_pdo(&im, CATEGORY_RXPDO, &piccolo_description.rx);
	put_dc(&im);
	put16(&im, 0xffff); /* end */
	return PICCOLO_EEPROM_OCTETS;
}
