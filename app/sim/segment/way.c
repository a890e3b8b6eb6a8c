/* SPDX-License-Identifier: MIT */
#include "segment/way.h"

#include <string.h>

/* Frame processing order of the chip: port 0, processing unit, 3, 1, 2, 0 (data sheet, section
 * I, 3.2). */
static unsigned next_port(unsigned port)
{
	static const unsigned next[WAY_PORTS] = { 3, 2, 0, 1 };

	return next[port];
}

static void process(struct way *way, unsigned slave, int64_t t_ns)
{
	if (way->count < LIMIT_SLAVES) {
		way->slave[way->count++] = (uint8_t)slave;
	}
	way->passing[slave].pu_ns = t_ns;
}

static void arrive(struct way *way, unsigned slave, unsigned port, int64_t t_ns)
{
	way->passing[slave].port_ns[port] = t_ns;
	way->passing[slave].ports_used |= (uint8_t)(1u << port);
}

void way_lay(const struct way_node *nodes, unsigned slave, unsigned port, int64_t wire_ns,
	     struct way *ret_way)
{
	struct way *way = ret_way;
	int64_t t = wire_ns;

	memset(way, 0, sizeof(*way));
	/* Each slave is entered by each of its ports once at most: more is a loop without a master.
	 */
	for (unsigned step = 0; step < LIMIT_SLAVES * WAY_PORTS; step++) {
		const struct way_node *n = &nodes[slave];
		const struct way_link *out;

		arrive(way, slave, port, t);
		if (port == 0) {
			process(way, slave, t);
		}
		t += port == 0 ? n->processing_ns : n->forwarding_ns;
		/* A closed port hands on inside the chip; behind port 0 lies the processing unit.
		 */
		for (port = next_port(port); !n->link[port].is_open; port = next_port(port)) {
			if (port == 0) {
				process(way, slave, t);
				t += n->processing_ns;
			}
		}
		out = &n->link[port];
		t += out->wire_ns;
		if (out->is_master) {
			way->is_back = 1;
			way->exit = out->master;
			way->back_ns = t;
			return;
		}
		slave = (unsigned)out->slave;
		port = out->port;
	}
}
