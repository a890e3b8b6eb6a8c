/* SPDX-License-Identifier: MIT */
/*
 * Registers of slaves, many at a time: accesses are packed into as few frames as possible, and a
 * lost frame is sent again (T42), so only what may be repeated belongs here. Context: service
 * thread.
 */
#ifndef BUS_REGISTERS_H
#define BUS_REGISTERS_H

#include <stddef.h>
#include <stdint.h>

#include "bus/access.h"
#include "bus/bus_internal.h"
#include "wire/esc_reg.h"

/** Do all accesses in order. 0, or -errno if a frame did not come back at all. */
int registers_run(struct bus *bus, struct access *access, size_t count);

/** One register of one slave. 0; -EIO no frame; -ENXIO the slave or the register does not answer;
 * -EBADMSG more than one device has this address.
 */
int register_read(struct bus *bus, size_t pos, uint16_t reg, void *ret_data, uint16_t len);
int register_write(struct bus *bus, size_t pos, uint16_t reg, const void *data, uint16_t len);
/** The same register of all slaves. Returns the WKC or -EIO. */
int register_broadcast(struct bus *bus, uint16_t reg, const void *data, uint16_t len);

#endif
