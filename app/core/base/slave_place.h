/* SPDX-License-Identifier: MIT */
/*
 * Where a slave is in the tree of ports, packed into the 32 bits that the status page has for it,
 * so that a reader never sees half of a change. Context: any.
 */
#ifndef BASE_SLAVE_PLACE_H
#define BASE_SLAVE_PLACE_H

#include <stdint.h>

enum { SLAVE_PORTS = 4 };

struct slave_place {
	int is_known;
	int parent;           /* position of the next slave towards the master; -1: the master */
	unsigned parent_port; /* of the parent, towards this slave; 0 for the master */
	unsigned entry_port;  /* of this slave, towards the master */
	unsigned open_ports;  /* a bit each, when the bus was scanned */
};

/* 0: not known. */
static inline uint32_t slave_place_pack(const struct slave_place *place)
{
	if (!place->is_known) {
		return 0;
	}
	return 1u << 31 | (place->open_ports & 0xf) << 20 | (place->parent_port & 3) << 18 |
	       (place->entry_port & 3) << 16 | (uint32_t)(place->parent + 1);
}

/* Not known, too, if what is packed cannot be of the slave at @pos: a parent comes before it. */
static inline struct slave_place slave_place_unpack(uint32_t packed, uint32_t pos)
{
	struct slave_place place = {
		.is_known = packed >> 31 != 0,
		.parent = (int)(packed & 0xffff) - 1,
		.parent_port = packed >> 18 & 3,
		.entry_port = packed >> 16 & 3,
		.open_ports = packed >> 20 & 0xf,
	};

	if (place.parent >= (int)pos) {
		place.is_known = 0;
	}
	return place.is_known ? place : (struct slave_place){ .parent = -1 };
}

#endif
