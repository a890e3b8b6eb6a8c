/* SPDX-License-Identifier: MIT */
/* From a slave model to its EEPROM image (ETG.1000.6, ETG.2010). */
#include <assert.h>
#include <string.h>

#include "base/bytes.h"
#include "devices/slave_model.h"
#include "wire/esc_reg.h"

enum sii_byte {
	SII_CHECKSUM = 0x0e,
	SII_VENDOR = 0x10,
	SII_PRODUCT = 0x14,
	SII_REVISION = 0x18,
	SII_BOOTSTRAP = 0x28,
	SII_MAILBOX = 0x30,
	SII_PROTOCOLS = 0x38,
	SII_SIZE = 0x7c,
	SII_VERSION = 0x7e,
};

enum { GENERAL_BYTES = 32, DC_MODE_BYTES = 24, PDO_BYTES = 8, SM_BYTES = 8, KIBIT_BYTES = 128 };

/* Every text, PDO, entry, SyncManager and DC mode that a model can have. */
static_assert(SII_CATEGORIES_BYTE + 2 + MODEL_TEXTS * SII_NAME_BYTES + GENERAL_BYTES +
			      SII_LIMIT_FMMU + SII_LIMIT_SM * SM_BYTES +
			      (SII_LIMIT_PDO + MODEL_ENTRIES) * PDO_BYTES +
			      MODEL_DC_MODES * DC_MODE_BYTES + 8 * 6 <=
		      MODEL_SII_BYTES,
	      "the image of any model fits");

struct writer {
	uint8_t *image;
	size_t pos;
	size_t body; /* of the open category */
};

static void put(struct writer *w, uint32_t value, size_t bytes)
{
	assert(w->pos + bytes <= MODEL_SII_BYTES);
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

static void put_strings(struct writer *w, const struct slave_model *m)
{
	begin(w, SII_CATEGORY_STRINGS);
	put(w, (uint32_t)m->text_count, 1);
	for (size_t i = 0; i < m->text_count; i++) {
		put(w, (uint32_t)strlen(m->text[i]), 1);
		for (const char *c = m->text[i]; *c != '\0'; c++) {
			put(w, (uint8_t)*c, 1);
		}
	}
	end(w);
}

/* Physical ports, a nibble each: 1 MII, 3 E-bus (the ESC's descriptor has 3 and 2). */
static uint16_t physical_ports(uint8_t descriptor)
{
	static const uint8_t nibble[] = { 0, 0, 3, 1 };
	uint16_t ports = 0;

	for (unsigned port = 0; port < ESC_PORTS; port++) {
		ports |= (uint16_t)(nibble[descriptor >> 2 * port & 3] << 4 * port);
	}
	return ports;
}

static void put_general(struct writer *w, const struct slave_model *m)
{
	const struct sii *s = &m->sii;

	begin(w, SII_CATEGORY_GENERAL);
	put(w, s->group_name, 1);
	put(w, 0, 1); /* image */
	put(w, s->order_name, 1);
	put(w, s->device_name, 1);
	put(w, 0, 1);
	put(w, s->coe_details, 1);
	put(w, (s->mailbox_protocols & SII_MAILBOX_FOE) != 0, 1);
	put(w, (s->mailbox_protocols & SII_MAILBOX_EOE) != 0, 1);
	put(w, 0, 3); /* SoE channels, DS 402 channels, system class */
	put(w, s->general_flags, 1);
	put(w, (uint16_t)m->ebus_ma, 2);
	put(w, 0, 2);
	put(w, physical_ports(m->features.port_descriptor), 2);
	while (w->pos < w->body + GENERAL_BYTES) {
		put(w, 0, 1);
	}
	end(w);
}

static void put_channels(struct writer *w, const struct sii *s)
{
	if (s->fmmu_count > 0) {
		begin(w, SII_CATEGORY_FMMU);
		for (size_t i = 0; i < s->fmmu_count; i++) {
			put(w, s->fmmu[i], 1);
		}
		end(w);
	}
	if (s->sm_count > 0) {
		begin(w, SII_CATEGORY_SM);
		for (size_t i = 0; i < s->sm_count; i++) {
			put(w, s->sm[i].start, 2);
			put(w, s->sm[i].len, 2);
			put(w, s->sm[i].control, 2);
			put(w, s->sm[i].enable, 1);
			put(w, s->sm[i].type, 1);
		}
		end(w);
	}
}

static void put_pdo(struct writer *w, const struct sii *s, const struct sii_pdo *pdo)
{
	put(w, pdo->index, 2);
	put(w, pdo->entry_count, 1);
	put(w, pdo->sm, 1);
	put(w, 0, 1);
	put(w, pdo->name, 1);
	put(w, 0, 2);
	for (size_t i = 0; i < pdo->entry_count; i++) {
		const struct sii_entry *e = &s->entry[pdo->first_entry + i];

		put(w, e->index, 2);
		put(w, e->subindex, 1);
		put(w, e->name, 1);
		put(w, e->data_type, 1);
		put(w, e->bit_len, 1);
		put(w, 0, 2);
	}
}

static void put_pdos(struct writer *w, const struct sii *s, uint8_t is_tx)
{
	size_t start = w->pos;

	begin(w, is_tx ? SII_CATEGORY_TXPDO : SII_CATEGORY_RXPDO);
	for (size_t i = 0; i < s->pdo_count; i++) {
		if (s->pdo[i].is_tx == is_tx) {
			put_pdo(w, s, &s->pdo[i]);
		}
	}
	end(w);
	if (w->pos == w->body) {
		w->pos = start; /* no such PDO, no category */
	}
}

static void put_dc(struct writer *w, const struct slave_model *m)
{
	if (m->dc_count == 0) {
		return;
	}
	begin(w, SII_CATEGORY_DC);
	for (size_t i = 0; i < m->dc_count; i++) {
		const struct model_dc_mode *dc = &m->dc[i];

		put(w, 0, 4); /* SYNC0: the master's cycle */
		put(w, (uint32_t)dc->sync0_shift_ns, 4);
		put(w, (uint32_t)dc->sync1_shift_ns, 4);
		put(w, (uint16_t)dc->sync1_factor, 2);
		put(w, dc->assign_activate, 2);
		put(w, (uint16_t)dc->sync0_factor, 2);
		put(w, dc->name, 1);
		put(w, 0, 1); /* description */
		put(w, 0, 4);
	}
	end(w);
}

static void put_words(uint8_t *image, const struct slave_model *m)
{
	const struct sii *s = &m->sii;

	for (size_t i = 0; i < MODEL_CONFIG_WORDS; i++) {
		put_le16(image + 2 * i, m->config[i]);
	}
	image[SII_CHECKSUM] = sii_checksum(image);
	put_le32(image + SII_VENDOR, s->vendor);
	put_le32(image + SII_PRODUCT, s->product);
	put_le32(image + SII_REVISION, s->revision);
	put_le16(image + SII_BOOTSTRAP, s->boot_out_start);
	put_le16(image + SII_BOOTSTRAP + 2, s->boot_out_len);
	put_le16(image + SII_BOOTSTRAP + 4, s->boot_in_start);
	put_le16(image + SII_BOOTSTRAP + 6, s->boot_in_len);
	put_le16(image + SII_MAILBOX, s->mailbox_out_start);
	put_le16(image + SII_MAILBOX + 2, s->mailbox_out_len);
	put_le16(image + SII_MAILBOX + 4, s->mailbox_in_start);
	put_le16(image + SII_MAILBOX + 6, s->mailbox_in_len);
	put_le16(image + SII_PROTOCOLS, s->mailbox_protocols);
	put_le16(image + SII_SIZE, (uint16_t)(s->size_bytes / KIBIT_BYTES - 1));
	put_le16(image + SII_VERSION, 1);
}

size_t slave_model_sii(const struct slave_model *model, uint8_t *image)
{
	struct writer w = { .image = image, .pos = SII_CATEGORIES_BYTE };

	memset(image, 0, MODEL_SII_BYTES);
	put_words(image, model);
	put_strings(&w, model);
	put_general(&w, model);
	put_channels(&w, &model->sii);
	put_pdos(&w, &model->sii, 1);
	put_pdos(&w, &model->sii, 0);
	put_dc(&w, model);
	put(&w, SII_CATEGORY_END, 2);
	return w.pos;
}
