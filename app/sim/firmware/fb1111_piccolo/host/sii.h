/* SPDX-License-Identifier: MIT */
/* The slave's EEPROM image, made from description.c (ETG.2010, ETG.1000.6). */
#ifndef FB1111_PICCOLO_HOST_SII_H
#define FB1111_PICCOLO_HOST_SII_H

#include <stddef.h>
#include <stdint.h>

/**
 * Write the image to @buf; returns its size (PICCOLO_EEPROM_OCTETS), or 0 with @buf untouched if
 * @cap is too small. Context: any.
 */
size_t fb1111_piccolo_sii(uint8_t *buf, size_t cap);

/** Checksum of EEPROM words 0 to 6 (x^8 + x^2 + x + 1, start 0xff). */
uint8_t fb1111_piccolo_sii_checksum(const uint8_t *config, size_t len);

#endif
