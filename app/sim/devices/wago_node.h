/* SPDX-License-Identifier: MIT */
/*
 * A WAGO I/O node seen from its EtherCAT coupler: which I/O modules are on its K-bus, and what
 * follows from them: PDOs and their order, the places of all terminals in the process image,
 * dictionary, EEPROM. The coupler has one SII for every node; the modules are found at power-on.
 * The source of each fact is in app/doc/reference/simulated-esc.md. Pure.
 */
#ifndef SIM_DEVICES_WAGO_NODE_H
#define SIM_DEVICES_WAGO_NODE_H

#include <stddef.h>
#include <stdint.h>

#include "devices/coe_dictionary.h"
#include "devices/slave_model.h"
#include "wire/sii.h"

enum wago_limits {
	WAGO_MODULES_MAX = 64, /* 0x6000 to 0x63F0 */
	WAGO_MODULE_BITS_MAX = 64,
	WAGO_HEADER_BYTES = 4, /* status or control of the coupler, in front of the modules' data */
	WAGO_DIRECTION_BYTES_MAX = WAGO_HEADER_BYTES + WAGO_MODULES_MAX * WAGO_MODULE_BITS_MAX / 8 +
		2,
};

enum wago_product { WAGO_VENDOR = 0x00000021, WAGO_PRODUCT = 0x07500354, WAGO_REVISION = 0x2 };

/* One kind of I/O module. */
struct wago_module {
	const char *order; /* "750-457" */
	uint32_t ident;    /* 0x9nn0:0A, 0xF050 */
	uint8_t channels;
	uint8_t bits; /* of a channel: 1 digital, 16 analog */
	uint8_t is_output;
	uint16_t data_type;
};

/** The kind with the number behind "750-": 457; NULL: not known here. */
const struct wago_module *wago_module_find(unsigned number);

struct wago_slot {
	const struct wago_module *module;
	uint32_t first_bit; /* of channel 1, in the image of its direction */
};

struct wago_node {
	struct wago_slot slot[WAGO_MODULES_MAX];
	size_t slot_count;
	uint32_t bytes[2]; /* of the process image: inputs, outputs */
	struct sii sii;    /* the coupler's, with the PDOs of the modules */
	struct coe_constant constant[3 * WAGO_MODULES_MAX + 8];
	size_t constant_count;
	uint8_t eeprom[MODEL_SII_BYTES];
	size_t eeprom_bytes;
};

/** 0; -E2BIG: more than WAGO_MODULES_MAX modules. */
int wago_node_init(struct wago_node *node, const struct wago_module *const *modules, size_t count);
/** What a dictionary over node->sii needs besides. */
void wago_node_complete(const struct wago_node *node, struct coe_dictionary *d);

#endif
