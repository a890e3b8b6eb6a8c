/* SPDX-License-Identifier: MIT */
/* The cables of the bus, by the tree of ports on the status page. Context: any. */
#ifndef CLI_CABLE_H
#define CLI_CABLE_H

#include <stddef.h>
#include <stdint.h>

#include "base/slave_place.h"
#include "base/status.h"

enum { CABLE_TEXT_BYTES = 192 };

enum cable_end_kind {
	CABLE_END_UNKNOWN, /* the tree is not known */
	CABLE_END_NONE,    /* no slave was found there */
	CABLE_END_MASTER,
	CABLE_END_SLAVE,
};

/* What a port of a slave is connected to. */
struct cable_end {
	enum cable_end_kind kind;
	uint32_t pos;  /* of CABLE_END_SLAVE */
	unsigned port; /* of that slave */
};

/** Where the slave at @pos is in the tree. */
struct slave_place cable_place(const struct status_page *page, uint32_t pos);
/** The other end of the cable at @port of the slave at @pos. */
struct cable_end cable_far_end(const struct status_page *page, uint32_t pos, unsigned port);
/**
 * "between rear: port 1 and top: port 0", the end towards the master first; "between ecat0 and
 * front: port 0"; "at front: port 2" where nothing is known of the other end.
 */
const char *cable_describe(const struct status_page *page, uint32_t pos, unsigned port,
			   char buf[CABLE_TEXT_BYTES]);

#endif
