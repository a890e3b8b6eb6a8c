/* SPDX-License-Identifier: MIT */
/*
 * The way of a frame through a segment: which processing units it meets in which order, and when
 * its start is at each port. Laid anew when a link changes; pure.
 */
#ifndef SIM_WAY_H
#define SIM_WAY_H

#include <stdint.h>

#include "base/limits.h"
#include "segment/segment.h"

enum { WAY_PORTS = 4, WAY_NOWHERE = -1 };

/* What is at the other end of a port's cable: slave and port, or WAY_NOWHERE; the master is far. */
struct way_link {
	int slave; /* WAY_NOWHERE: nothing, or @master */
	unsigned port;
	int is_master;
	enum segment_port master;
	int64_t wire_ns;
	int is_open; /* link on both ends, loop open */
};

struct way_node {
	struct way_link link[WAY_PORTS];
	int64_t processing_ns;
	int64_t forwarding_ns;
};

/* Times from the moment at which the frame leaves the master. */
struct way {
	unsigned count;
	uint8_t slave[LIMIT_SLAVES];            /* in the order of processing */
	struct esc_frame passing[LIMIT_SLAVES]; /* by slave */
	int is_back;
	enum segment_port exit;
	int64_t back_ns;
};

/** The way of a frame that enters at @port of @slave, @wire_ns after it has left the master. */
void way_lay(const struct way_node *nodes, unsigned slave, unsigned port, int64_t wire_ns,
	     struct way *ret_way);

#endif
