/* SPDX-License-Identifier: MIT */
#include "devices/wago_node.h"

#include <assert.h>
#include <errno.h>
#include <string.h>

#include "devices/catalogue.h"

enum object {
	MODULE_DISTANCE = 0x10, /* between two modules' indices */
	PDO_COUPLER = 0xff,     /* of 0x1600 and 0x1A00: the coupler's own */
	PDO_PADDING = 0x101,    /* 0x1701, 0x1B01 */
	RXPDO = 0x1600,
	TXPDO = 0x1a00,
	MODULE_INPUTS = 0x6000,
	MODULE_OUTPUTS = 0x7000,
	MODULE_INFORMATION = 0x9000,
	MODULE_IDENT_SUBINDEX = 0x0a,
	DIAGNOSIS = 0x10f3,
	MODULAR_PROFILE = 0xf000,
	MODULES_FOUND = 0xf050,
	COUPLER_STATUS = 0xf100,
	COUPLER_CONTROL = 0xf200,
};

enum { SM_OUTPUTS_NUMBER = 2, SM_INPUTS_NUMBER = 3, WORD_BITS = 16 };

/* ETG.1020 base data types. */
enum { TYPE_BOOL = 0x01, TYPE_INT16 = 0x03, TYPE_UINT16 = 0x06 };

/* Text n - 1 is entry name n; channel n has name n. */
enum text {
	TEXT_CHANNELS = 8,
	TEXT_OVERRUN,
	TEXT_INPUT_HELD,
	TEXT_OUTPUT_HELD,
	TEXT_OUTPUT_CLEARED,
	TEXT_MESSAGES,
	TEXT_STATUS,
	TEXT_OVERRUN_DISABLE,
	TEXT_INPUT_HOLD,
	TEXT_OUTPUT_HOLD,
	TEXT_OUTPUT_CLEAR,
	TEXT_CONTROL,
	TEXTS = TEXT_CONTROL,
};

static const char *const texts[TEXTS] = {
	"Channel 1 Data",
	"Channel 2 Data",
	"Channel 3 Data",
	"Channel 4 Data",
	"Channel 5 Data",
	"Channel 6 Data",
	"Channel 7 Data",
	"Channel 8 Data",
	[TEXT_OVERRUN - 1] = "K-Bus Cycle Overrun Flag",
	[TEXT_INPUT_HELD - 1] = "Input Process Data Hold Ack",
	[TEXT_OUTPUT_HELD - 1] = "Output Process Data Hold Ack",
	[TEXT_OUTPUT_CLEARED - 1] = "Output Process Data Clear Ack",
	[TEXT_MESSAGES - 1] = "New Messages Available",
	[TEXT_STATUS - 1] = "Diagnostics Status Word",
	[TEXT_OVERRUN_DISABLE - 1] = "K-Bus Cycle Overrun Flag Disable",
	[TEXT_INPUT_HOLD - 1] = "Input Process Data Hold Request",
	[TEXT_OUTPUT_HOLD - 1] = "Output Process Data Hold Request",
	[TEXT_OUTPUT_CLEAR - 1] = "Output Process Data Clear Request",
	[TEXT_CONTROL - 1] = "Diagnostics Control Word",
};

const struct wago_module *wago_module_find(unsigned number)
{
	static const struct {
		unsigned number;
		struct wago_module module;
	} known[] = {
		{ 430, { "750-430", 0x80000081, 8, 1, 0, TYPE_BOOL } },
		{ 457, { "750-457", 0x04570000, 4, 16, 0, TYPE_INT16 } },
		{ 530, { "750-530", 0x80000082, 8, 1, 1, TYPE_BOOL } },
		{ 557, { "750-557", 0x05570000, 4, 16, 1, TYPE_INT16 } },
	};

	for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++) {
		if (known[i].number == number) {
			return &known[i].module;
		}
	}
	return NULL;
}

/* --- PDOs --- */

struct pdo_writer {
	struct sii *sii;
	struct sii_pdo *pdo; /* the open one */
	uint32_t bits;       /* of the direction so far */
	uint8_t is_output;
};

static void begin_pdo(struct pdo_writer *w, unsigned number)
{
	w->pdo = &w->sii->pdo[w->sii->pdo_count++];
	*w->pdo = (struct sii_pdo){
		.index = (uint16_t)((w->is_output ? RXPDO : TXPDO) + number),
		.sm = w->is_output ? SM_OUTPUTS_NUMBER : SM_INPUTS_NUMBER,
		.is_tx = !w->is_output,
		.first_entry = (uint16_t)w->sii->entry_count,
	};
}

static void put_entry(struct pdo_writer *w, const struct sii_entry *entry)
{
	w->sii->entry[w->sii->entry_count++] = *entry;
	w->pdo->entry_count++;
	w->pdo->bits += entry->bit_len;
	w->bits += entry->bit_len;
}

static void put_bits(struct pdo_writer *w, uint16_t index, uint8_t subindex, uint8_t bits,
		     unsigned text)
{
	put_entry(w, &(struct sii_entry){ .index = index,
					  .subindex = subindex,
					  .bit_len = bits,
					  .data_type = index == 0  ? 0
						       : bits == 1 ? TYPE_BOOL
								   : TYPE_UINT16,
					  .name = (uint8_t)text });
}

static void put_coupler(struct pdo_writer *w)
{
	uint16_t index = w->is_output ? COUPLER_CONTROL : COUPLER_STATUS;
	unsigned text = w->is_output ? TEXT_OVERRUN_DISABLE : TEXT_OVERRUN;

	begin_pdo(w, PDO_COUPLER);
	for (uint8_t i = 0; i < 4; i++) {
		put_bits(w, index, (uint8_t)(i + 1), 1, text + i);
	}
	if (w->is_output) {
		put_bits(w, 0, 0, 12, 0);
	} else {
		put_bits(w, 0, 0, 11, 0);
		put_bits(w, DIAGNOSIS, 4, 1, TEXT_MESSAGES);
	}
	put_bits(w, index, 5, WORD_BITS, w->is_output ? TEXT_CONTROL : TEXT_STATUS);
}

static void put_module(struct pdo_writer *w, struct wago_slot *slot, size_t number)
{
	const struct wago_module *m = slot->module;
	unsigned base = w->is_output ? MODULE_OUTPUTS : MODULE_INPUTS;

	slot->first_bit = w->bits;
	begin_pdo(w, (unsigned)number);
	for (uint8_t c = 1; c <= m->channels; c++) {
		put_entry(w,
			  &(struct sii_entry){ .index = (uint16_t)(base + number * MODULE_DISTANCE),
					       .subindex = c,
					       .bit_len = m->bits,
					       .data_type = (uint8_t)m->data_type,
					       .name = c });
	}
}

/* The coupler; analog modules, then digital ones, each in the order of the K-bus; whole words. */
static void put_direction(struct wago_node *node, uint8_t is_output)
{
	struct pdo_writer w = { .sii = &node->sii, .is_output = is_output };

	put_coupler(&w);
	for (int is_digital = 0; is_digital < 2; is_digital++) {
		for (size_t i = 0; i < node->slot_count; i++) {
			const struct wago_module *m = node->slot[i].module;

			if (m->is_output == is_output && (m->bits == 1) == is_digital) {
				put_module(&w, &node->slot[i], i);
			}
		}
	}
	if (w.bits % WORD_BITS != 0) {
		begin_pdo(&w, PDO_PADDING);
		put_bits(&w, 0, 0, (uint8_t)(WORD_BITS - w.bits % WORD_BITS), 0);
	}
	node->bytes[is_output] = w.bits / 8;
}

/* --- dictionary --- */

static void put_constant(struct wago_node *node, unsigned index, unsigned subindex, uint32_t value,
			 uint8_t bytes)
{
	node->constant[node->constant_count++] =
		(struct coe_constant){ .index = (uint16_t)index,
				       .subindex = (uint8_t)subindex,
				       .bytes = bytes,
				       .value = value };
}

static void put_constants(struct wago_node *node)
{
	put_constant(node, MODULAR_PROFILE, 0, 2, 1);
	put_constant(node, MODULAR_PROFILE, 1, MODULE_DISTANCE, 2);
	put_constant(node, MODULAR_PROFILE, 2, WAGO_MODULES_MAX, 2);
	put_constant(node, MODULES_FOUND, 0, (uint32_t)node->slot_count, 1);
	for (unsigned i = 0; i < node->slot_count; i++) {
		unsigned information = MODULE_INFORMATION + i * MODULE_DISTANCE;
		uint32_t ident = node->slot[i].module->ident;

		put_constant(node, MODULES_FOUND, i + 1, ident, 4);
		put_constant(node, information, 0, MODULE_IDENT_SUBINDEX, 1);
		put_constant(node, information, MODULE_IDENT_SUBINDEX, ident, 4);
	}
}

void wago_node_complete(const struct wago_node *node, struct coe_dictionary *d)
{
	d->constant = node->constant;
	d->constant_count = node->constant_count;
	d->text = texts;
	d->text_count = TEXTS;
	d->is_fixed = 1;
}

/* Three buffers between SM2 at 0x1800 and SM3 at 0x2400, and three from there to the RAM's end. */
static_assert(3 * WAGO_DIRECTION_BYTES_MAX <= 0xc00, "every node fits");
static_assert(WAGO_MODULES_MAX + 2 <= COE_ASSIGNED_MAX, "every PDO can be assigned");

int wago_node_init(struct wago_node *node, const struct wago_module *const *modules, size_t count)
{
	if (count > WAGO_MODULES_MAX) {
		return -E2BIG;
	}
	memset(node, 0, sizeof(*node));
	node->eeprom_bytes = catalogue_image("wago_750_354", node->eeprom, &node->sii);
	for (size_t i = 0; i < count; i++) {
		node->slot[i].module = modules[i];
	}
	node->slot_count = count;
	put_direction(node, 1);
	put_direction(node, 0);
	put_constants(node);
	return 0;
}
