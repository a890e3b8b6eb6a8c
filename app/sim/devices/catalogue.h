/* SPDX-License-Identifier: MIT */
/*
 * The catalogue of simulated slaves: the texts of app/sim/catalogue, built into the library. From
 * an entry, or from the SII image of a real device, comes the list of slaves of a segment.
 */
#ifndef SIM_DEVICES_CATALOGUE_H
#define SIM_DEVICES_CATALOGUE_H

#include <stddef.h>
#include <stdint.h>

#include "devices/slave_model.h"
#include "segment/segment.h"

size_t catalogue_count(void);
/** Entry @i, in alphabetical order. An entry that cannot be parsed ends the program. */
void catalogue_read(size_t i, struct slave_model *ret);
/** The entry called @name; -ENOENT. */
int catalogue_find(const char *name, struct slave_model *ret);
/** The names nearest to @name, with commas; "" where none is near. */
void catalogue_near(const char *name, char *ret_text, size_t text_bytes);

/** Features of the ESC in the device with this identity; an ET1100's where it is not known. */
const struct esc_features *catalogue_features(uint32_t vendor, uint32_t product);

/**
 * Fill the spec of a slave behind slave @position - 1 of a line, from a model, or from an SII image
 * (kept until segment_create()). 0 or -ENOMEM.
 */
int catalogue_slave(const struct slave_model *model, int position,
		    struct segment_slave_spec *ret_spec);
int catalogue_sii_slave(const uint8_t *sii, size_t sii_bytes, int position,
			struct segment_slave_spec *ret_spec);

/** The EEPROM image of entry @name, which is there, into @image of MODEL_SII_BYTES; its length. */
size_t catalogue_image(const char *name, uint8_t *image, struct sii *ret_sii);

#endif
