/* SPDX-License-Identifier: MIT */
/*
 * The devices on the wire by position, in the order in which a frame passes them. Accesses are by
 * auto-increment address, so that they do not depend on station addresses. Context: service thread.
 */
#ifndef BUS_WALK_H
#define BUS_WALK_H

#include <stddef.h>
#include <stdint.h>

#include "bus/bus_internal.h"
#include "bus/registers.h"

enum { WALK_POSITIONS = LIMIT_SLAVES + GUESTS_MAX };

struct position {
	uint8_t address[2]; /* station address */
	uint8_t dl_status[2];
	int slave; /* that is bound to it; -1: none */
};

struct walk {
	size_t count;
	struct position at[WALK_POSITIONS];
};

/** Read @walk->count positions; nothing is bound yet. 0; -EAGAIN: one did not answer exactly once,
 * or there is one more; another -errno of the wire. */
int walk_positions(struct bus *bus, struct walk *walk);
/** How many positions have @address. */
unsigned walk_claims(const struct walk *walk, uint16_t address);

/* Ports of a position, a bit each. */
uint8_t walk_linked_ports(const struct position *at);
uint8_t walk_open_ports(const struct position *at);

/** An access to the device at @position. */
static inline struct access walk_access(enum ecat_cmd cmd, size_t position, uint16_t reg,
					void *data, uint16_t len)
{
	return (struct access){
		.cmd = cmd, .adp = (uint16_t)-position, .reg = reg, .len = len, .data = data
	};
}

#endif
