/* SPDX-License-Identifier: MIT */
/*
 * What a name or an SII image stands for: ESC features by what the real device has shown, delays by
 * its kind of port. Used to make the list of slaves that a segment is built from.
 */
#ifndef SIM_DEVICES_CATALOGUE_H
#define SIM_DEVICES_CATALOGUE_H

#include <stddef.h>
#include <stdint.h>

#include "segment/segment.h"

/** Features of the ESC in the device with this identity; an ET1100's where it is not known. */
const struct esc_features *catalogue_features(uint32_t vendor, uint32_t product);

/** The generic slave of @sii (kept until segment_create()), in line behind @position - 1. -ENOMEM,
 * 0. */
int catalogue_sii_slave(const uint8_t *sii, size_t sii_bytes, int position,
			struct segment_slave_spec *ret_spec);

#endif
