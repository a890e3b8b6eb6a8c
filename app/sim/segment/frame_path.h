/* SPDX-License-Identifier: MIT */
/*
 * The path of a frame through a segment: which processing units it passes in which order, and when
 * its start is at each port. Computed again when a link changes; pure.
 */
#ifndef SIM_SEGMENT_FRAME_PATH_H
#define SIM_SEGMENT_FRAME_PATH_H

#include <stdint.h>

#include "base/limits.h"
#include "segment/esc.h"

enum { PATH_PORTS = 4, PATH_NOWHERE = -1 };

enum segment_port { SEGMENT_PRIMARY, SEGMENT_SECONDARY, SEGMENT_PORTS };

/* What is at the other end of a port's cable: slave and port, or PATH_NOWHERE; or the
 * master. */
struct path_link {
	int slave; /* PATH_NOWHERE: nothing, or @master */
	unsigned port;
	int is_master;
	enum segment_port master;
	int64_t wire_ns;
	int is_open; /* link on both ends, loop open */
};

struct path_node {
	struct path_link link[PATH_PORTS];
	int64_t processing_ns;
	int64_t forwarding_ns;
};

/* Times from the moment at which the frame leaves the master. */
struct frame_path {
	unsigned count;
	uint16_t slave[LIMIT_SLAVES];           /* in the order of processing */
	struct esc_frame passing[LIMIT_SLAVES]; /* by slave */
	int is_back;
	enum segment_port exit;
	int64_t back_ns;
};

/** The path of a frame that enters at @port of @slave, @wire_ns after it has left the master. */
void frame_path_find(const struct path_node *nodes, unsigned slave, unsigned port, int64_t wire_ns,
		     struct frame_path *ret_path);

#endif
