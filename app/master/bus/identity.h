/* SPDX-License-Identifier: MIT */
/* What a device is by its EEPROM. Context: service thread. */
#ifndef BUS_IDENTITY_H
#define BUS_IDENTITY_H

#include <stddef.h>
#include <stdint.h>

#include "bus/bus_internal.h"

/* At the same time, in one frame: those of all guests and of the reference clock. */
enum { IDENTITY_READERS = GUESTS_MAX + 1 };

/** Begin to read it from the EEPROM of the device with station address @station; @give_up bounds
 * it. */
void identity_begin(struct identity_reader *reader, uint16_t station, mono_t give_up);
/**
 * Go on with @count readers, at most IDENTITY_READERS, by one frame. Their result: 1 being read; 0
 * identity is filled; -errno as eeprom_take(); -EBADMSG also: the EEPROM's checksum is wrong;
 * -ENODATA it is blank; -ETIME no frame came back until the time was over.
 */
void identity_step(struct bus *bus, struct identity_reader *const *reader, size_t count);

/** Vendor, product, revision, alias, and the serial number where the slave has one. */
int bus_is_same_device(const struct bus_slave *sl, const struct bus_identity *found);

/**
 * The explicit device identification of the slave at @pos: its number after a request in AL control
 * (ETG.1020), the state kept. 0: it has none. Waits up to 200 ms.
 */
uint16_t bus_identification_read(struct bus *bus, size_t pos);

#endif
