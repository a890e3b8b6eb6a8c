/* SPDX-License-Identifier: MIT */
#include "bus/dc_topology.h"

#include <errno.h>

#include "base/limits.h"

/* The order in which a frame passes the ports of a slave controller. */
static const uint8_t port_order[DC_PORTS] = { 0, 3, 1, 2 };

static int is_timed(const struct dc_node *n)
{
	return n->kind != CLOCK_NONE;
}

static int has_port(const struct dc_node *n, uint8_t port)
{
	return (n->ports >> port & 1) != 0;
}

/* @a before @b on a clock of 32 bits that wraps; both are within two seconds. */
static int is_earlier(uint32_t a, uint32_t b)
{
	return (int32_t)(a - b) < 0;
}

static uint8_t find_entry_port(const struct dc_node *n)
{
	int entry = -1;

	for (int i = 0; i < DC_PORTS; i++) {
		uint8_t port = port_order[i];

		if (!has_port(n, port)) {
			continue;
		}
		if (entry < 0 || (is_timed(n) && is_earlier(n->time_ns[port], n->time_ns[entry]))) {
			entry = port;
		}
	}
	return entry < 0 ? 0 : (uint8_t)entry;
}

static int place_of(uint8_t port)
{
	int place = 0;

	while (port_order[place] != port) {
		place++;
	}
	return place;
}

/* The open port after @port in the frame's order; the entry port when there is none. */
static uint8_t next_port(const struct dc_node *n, uint8_t port)
{
	int place = place_of(port);

	for (int i = 1; i <= DC_PORTS; i++) {
		uint8_t next = port_order[(place + i) % DC_PORTS];

		if (next == n->entry_port || has_port(n, next)) {
			return next;
		}
	}
	return n->entry_port;
}

static uint8_t previous_port(const struct dc_node *n, uint8_t port)
{
	uint8_t at = n->entry_port;

	while (next_port(n, at) != port) {
		at = next_port(n, at);
	}
	return at;
}

/* The parent of a slave is the last one before it that still has a free open port. */
static int find_parents(struct dc_node *node, size_t count)
{
	int stack[LIMIT_SLAVES];
	uint8_t free_port[LIMIT_SLAVES];
	int depth = 0;

	for (size_t i = 0; i < count; i++) {
		struct dc_node *n = &node[i];

		n->entry_port = find_entry_port(n);
		n->cable_ns = -1;
		while (depth > 0 && free_port[depth - 1] == node[stack[depth - 1]].entry_port) {
			depth--;
		}
		if (depth == 0 && i > 0) {
			return -EPROTO;
		}
		n->parent = depth > 0 ? stack[depth - 1] : -1;
		n->parent_port = depth > 0 ? free_port[depth - 1] : 0;
		if (depth > 0) {
			free_port[depth - 1] = next_port(&node[n->parent], n->parent_port);
		}
		stack[depth] = (int)i;
		free_port[depth] = next_port(n, n->entry_port);
		depth++;
	}
	return 0;
}

/* Time from the frame's first coming to the slave to its last coming back. */
static int64_t loop_ns(const struct dc_node *n)
{
	uint8_t last = previous_port(n, n->entry_port);

	return last == n->entry_port ? 0 : (int64_t)(n->time_ns[last] - n->time_ns[n->entry_port]);
}

/* The frame's way through slaves without clocks: edges passed in all, and the timed slaves on it.
 */
struct tour {
	unsigned hops;
	size_t met[LIMIT_SLAVES];
	unsigned hops_before[LIMIT_SLAVES];
	size_t met_count;
};

/* Follow the frame behind @port of @parent: down to the next timed slave of each branch. */
static void tour_branch(const struct dc_node *node, size_t count, size_t parent, uint8_t port,
			struct tour *ret)
{
	int inside[LIMIT_SLAVES] = { 0 };
	unsigned depth[LIMIT_SLAVES] = { 0 };
	unsigned at = 0; /* depth where the frame is */

	*ret = (struct tour){ 0 };
	for (size_t i = parent + 1; i < count; i++) {
		int up = node[i].parent;
		int is_direct = up == (int)parent && node[i].parent_port == port;

		if (!is_direct && (up < 0 || !inside[up] || is_timed(&node[up]))) {
			continue;
		}
		inside[i] = 1;
		depth[i] = (is_direct ? 0 : depth[up]) + 1;
		ret->hops += at - (depth[i] - 1) + 1;
		at = depth[i];
		if (is_timed(&node[i])) {
			ret->met[ret->met_count] = i;
			ret->hops_before[ret->met_count++] = ret->hops;
		}
	}
	ret->hops += at;
}

/* Arrival times of the timed slaves behind one port of a timed slave. */
static void solve_branch(struct dc_node *node, size_t count, size_t parent, uint8_t port)
{
	const struct dc_node *p = &node[parent];
	uint8_t before = previous_port(p, port);
	int64_t start_ns =
		p->arrival_ns + (int64_t)(p->time_ns[before] - p->time_ns[p->entry_port]);
	int64_t wire_ns = (int64_t)(p->time_ns[port] - p->time_ns[before]);
	int64_t loops_ns = 0;
	struct tour tour;

	tour_branch(node, count, parent, port, &tour);
	for (size_t i = 0; i < tour.met_count; i++) {
		wire_ns -= loop_ns(&node[tour.met[i]]);
	}
	if (wire_ns < 0) {
		wire_ns = 0;
	}
	for (size_t i = 0; i < tour.met_count; i++) {
		struct dc_node *n = &node[tour.met[i]];

		/* Slaves without clocks between: how it is shared among the cables is not known. */
		if (n->parent == (int)parent) {
			n->cable_ns = wire_ns / (int64_t)tour.hops;
		}
		n->arrival_ns = start_ns + loops_ns +
				wire_ns * (int64_t)tour.hops_before[i] / (int64_t)tour.hops;
		loops_ns += loop_ns(n);
	}
}

static int has_timed_ancestor(const struct dc_node *node, size_t i)
{
	for (int up = node[i].parent; up >= 0; up = node[up].parent) {
		if (is_timed(&node[up])) {
			return 1;
		}
	}
	return 0;
}

int dc_topology_solve(struct dc_node *node, size_t count)
{
	int64_t top_ns = 0; /* where the next clock without one above it begins */
	int reference = -ENOENT;
	int r = find_parents(node, count);

	if (r < 0) {
		return r;
	}
	for (size_t i = 0; i < count; i++) {
		struct dc_node *n = &node[i];

		n->delay_ns = 0;
		if (!is_timed(n)) {
			continue;
		}
		if (!has_timed_ancestor(node, i)) {
			n->arrival_ns = top_ns;
			top_ns += loop_ns(n);
		}
		for (uint8_t port = next_port(n, n->entry_port); port != n->entry_port;
		     port = next_port(n, port)) {
			solve_branch(node, count, i, port);
		}
		if (reference < 0 && n->kind == CLOCK_SYSTEM_TIME) {
			reference = (int)i;
		}
	}
	for (size_t i = 0; reference >= 0 && i < count; i++) {
		if (is_timed(&node[i]) && i >= (size_t)reference) {
			int64_t delay_ns = node[i].arrival_ns - node[reference].arrival_ns;

			node[i].delay_ns = delay_ns > 0 ? delay_ns : 0;
		}
	}
	return reference;
}
