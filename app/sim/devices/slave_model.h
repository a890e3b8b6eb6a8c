/* SPDX-License-Identifier: MIT */
/*
 * A simulated slave as its catalogue entry describes it: what its EEPROM says, which ESC it has,
 * and what its inputs show. app/doc/reference/simulated-slaves.md describes the text format.
 */
#ifndef SIM_DEVICES_SLAVE_MODEL_H
#define SIM_DEVICES_SLAVE_MODEL_H

#include <stddef.h>
#include <stdint.h>

#include "segment/esc.h"
#include "wire/sii.h"

enum slave_model_limits {
	MODEL_NAME_BYTES = 32,
	MODEL_TEXTS = 96,
	MODEL_ENTRIES = 256,
	MODEL_DC_MODES = 4,
	MODEL_CONFIG_WORDS = 7,
	MODEL_SII_BYTES = 16384, /* enough for any model: see the assertion in sii_build.c */
};

/* What an input entry shows. */
enum model_source {
	MODEL_ZERO,
	MODEL_COUNT,      /* passes of the slave's main loop */
	MODEL_TOGGLE,     /* 0 and 1 in turn, with each new value */
	MODEL_SIGNAL,     /* the slave's analog signal; channel n lags n quarter turns */
	MODEL_FOLLOW,     /* the output entry index:subindex */
	MODEL_STATUSWORD, /* of CiA 402, from the controlword in index:subindex */
	MODEL_FIXED,      /* counts */
};

struct model_input {
	enum model_source source;
	uint16_t index;
	uint8_t subindex;
	uint8_t channel;
	double low_v; /* below it the value stays */
	double high_v;
	int64_t counts; /* at high_v; of MODEL_FIXED: the value */
};

/* One record of the SII's DC category. */
struct model_dc_mode {
	uint16_t assign_activate;
	int16_t sync0_factor;
	int32_t sync0_shift_ns;
	int16_t sync1_factor;
	int32_t sync1_shift_ns;
	uint8_t name; /* text number */
};

struct slave_model {
	char name[MODEL_NAME_BYTES]; /* in the catalogue */
	struct sii sii;              /* TxPDOs first; its string numbers count text[] from 1 */
	uint16_t config[MODEL_CONFIG_WORDS]; /* words 0 to 6 of the SII */
	int16_t ebus_ma;                     /* current taken from the E-bus; below 0: supplied */
	uint16_t device_type;                /* object 0x1000 */
	char text[MODEL_TEXTS][SII_NAME_BYTES];
	size_t text_count;
	struct model_dc_mode dc[MODEL_DC_MODES];
	size_t dc_count;
	struct model_input input[MODEL_ENTRIES]; /* by number of the entry in sii */
	uint32_t unit[MODEL_ENTRIES];            /* the same; wire/coe_unit.h */
	struct esc_features features;
};

/**
 * Parse @text, the catalogue entry called @name. 0; -EBADMSG: it is wrong, with one line
 * "NAME.txt:LINE: ..." in @error; @ret is undefined then.
 */
int slave_model_parse(const char *name, const char *text, struct slave_model *ret, char *error,
		      size_t error_bytes);

/** The EEPROM image of @model into @image of MODEL_SII_BYTES. Returns its length. */
size_t slave_model_sii(const struct slave_model *model, uint8_t *image);

/** ESC features by the name that the "esc" line uses; NULL: unknown. */
const struct esc_features *esc_chip_find(const char *name);

#endif
