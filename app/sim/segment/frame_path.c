/* SPDX-License-Identifier: MIT */
#include "segment/frame_path.h"

#include <string.h>

/* Frame processing order of the chip: port 0, processing unit, 3, 1, 2, 0 (data sheet, section
 * I, 3.2). */
static unsigned next_port(unsigned port)
{
	static const unsigned next[PATH_PORTS] = { 3, 2, 0, 1 };

	return next[port];
}

static void process(struct frame_path *path, unsigned slave, int64_t t_ns)
{
	if (path->count < LIMIT_SLAVES) {
		path->slave[path->count++] = (uint16_t)slave;
	}
	path->passing[slave].pu_ns = t_ns;
}

static void arrive(struct frame_path *path, unsigned slave, unsigned port, int64_t t_ns)
{
	path->passing[slave].port_ns[port] = t_ns;
	path->passing[slave].ports_used |= (uint8_t)(1u << port);
}

void frame_path_find(const struct path_node *nodes, unsigned slave, unsigned port, int64_t wire_ns,
		     struct frame_path *ret_path)
{
	struct frame_path *path = ret_path;
	int64_t t = wire_ns;

	memset(path, 0, sizeof(*path));
	/* Each slave is entered by each of its ports once at most: more is a loop without a master.
	 */
	for (unsigned step = 0; step < LIMIT_SLAVES * PATH_PORTS; step++) {
		const struct path_node *n = &nodes[slave];
		const struct path_link *out;

		arrive(path, slave, port, t);
		if (port == 0) {
			process(path, slave, t);
		}
		t += port == 0 ? n->processing_ns : n->forwarding_ns;
		/* A closed port hands on inside the chip; behind port 0 is the processing unit.
		 */
		for (port = next_port(port); !n->link[port].is_open; port = next_port(port)) {
			if (port == 0) {
				process(path, slave, t);
				t += n->processing_ns;
			}
		}
		out = &n->link[port];
		t += out->wire_ns;
		if (out->is_master) {
			path->is_back = 1;
			path->exit = out->master;
			path->back_ns = t;
			return;
		}
		slave = (unsigned)out->slave;
		port = out->port;
	}
}
