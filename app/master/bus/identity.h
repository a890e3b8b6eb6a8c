/* SPDX-License-Identifier: MIT */
/* What a device is by its EEPROM. Context: service thread. */
#ifndef BUS_IDENTITY_H
#define BUS_IDENTITY_H

#include <stddef.h>
#include <stdint.h>

#include "bus/bus_internal.h"

/**
 * Read it from the EEPROM of the device with station address @station. 0; -EAGAIN: busy, loading,
 * or no single answer: try again; -EBADMSG: its checksum is wrong; -ENODATA: it is blank;
 * -EREMOTEIO: it does not acknowledge. @ret is untouched on failure. Takes a few frames for each of
 * three to five reads.
 */
int bus_identity_read(struct bus *bus, uint16_t station, struct bus_identity *ret);

/** Vendor, product, revision, alias, and the serial number where the slave has one. */
int bus_is_same_device(const struct bus_slave *sl, const struct bus_identity *found);

/**
 * The explicit device identification of the slave at @pos: its number after a request in AL control
 * (ETG.1020), the state kept. 0: it has none. Waits up to 200 ms.
 */
uint16_t bus_identification_read(struct bus *bus, size_t pos);

#endif
