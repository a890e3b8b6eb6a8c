/* SPDX-License-Identifier: MIT */
/* Cables, power and crystals, as they change while the segment runs. */
#include <errno.h>

#include "segment/segment_internal.h"

static void lose_upper_end(struct segment *seg, const struct node *n)
{
	if (n->parent >= 0) {
		esc_count_error(&seg->node[n->parent].esc, n->parent_port, ESC_ERROR_LOST_LINK);
	}
}

void segment_cut(struct segment *segment, size_t slave, int64_t t_ns)
{
	struct node *n = &segment->node[slave];

	segment_advance(segment, t_ns);
	if (!n->is_cut) {
		n->is_cut = 1;
		lose_upper_end(segment, n);
		esc_count_error(&n->esc, 0, ESC_ERROR_LOST_LINK);
		segment_find_paths(segment);
	}
}

void segment_heal(struct segment *segment, size_t slave, int64_t t_ns)
{
	segment_advance(segment, t_ns);
	segment->node[slave].is_cut = 0;
	segment_find_paths(segment);
}

/* Its neighbour behind port 1; PATH_NOWHERE: none. -2: it cannot be taken out. */
static int find_behind(const struct segment *seg, size_t slave)
{
	const struct path_link *l = seg->wiring[slave].link;

	for (unsigned port = 1; port < PATH_PORTS; port++) {
		if (l[port].is_master || (port > 1 && l[port].slave != PATH_NOWHERE)) {
			return -2;
		}
	}
	return l[1].slave;
}

static void connect_down(struct segment *seg, size_t slave, int to, unsigned port)
{
	struct node *n = &seg->node[slave];

	if (n->parent < 0) {
		seg->first = to;
		return;
	}
	seg->wiring[n->parent].link[n->parent_port] =
		(struct path_link){ .slave = to, .port = port, .wire_ns = n->wire_ns };
}

/* What is behind @slave has its parent's port, or @slave's again, in front of it. */
static void connect_up(struct segment *seg, int behind, struct path_link up)
{
	struct path_link *l = &seg->wiring[behind].link[0];

	up.wire_ns = l->wire_ns;
	*l = up;
}

int segment_unplug(struct segment *segment, size_t slave, int64_t t_ns)
{
	int behind = find_behind(segment, slave);
	struct node *n = &segment->node[slave];

	if (behind == -2 || n->is_unplugged || (n->parent < 0 && behind == PATH_NOWHERE)) {
		return -EINVAL;
	}
	segment_advance(segment, t_ns);
	n->is_unplugged = 1;
	connect_down(segment, slave, behind, 0);
	if (behind != PATH_NOWHERE) {
		connect_up(segment, behind, segment->wiring[slave].link[0]);
	}
	segment_find_paths(segment);
	return 0;
}

int segment_plug(struct segment *segment, size_t slave, int64_t t_ns)
{
	struct node *n = &segment->node[slave];
	int behind = find_behind(segment, slave);

	if (!n->is_unplugged) {
		return -EINVAL;
	}
	segment_advance(segment, t_ns);
	n->is_unplugged = 0;
	connect_down(segment, slave, (int)slave, 0);
	if (behind != PATH_NOWHERE) {
		connect_up(segment, behind, (struct path_link){ .slave = (int)slave, .port = 1 });
	}
	segment_find_paths(segment);
	return 0;
}

void segment_cut_ring(struct segment *segment, int64_t t_ns)
{
	segment_advance(segment, t_ns);
	if (segment->ring_slave != PATH_NOWHERE && !segment->is_ring_cut) {
		segment->is_ring_cut = 1;
		esc_count_error(&segment->node[segment->ring_slave].esc, segment->ring_port,
				ESC_ERROR_LOST_LINK);
		segment_find_paths(segment);
	}
}

void segment_heal_ring(struct segment *segment, int64_t t_ns)
{
	segment_advance(segment, t_ns);
	segment->is_ring_cut = 0;
	segment_find_paths(segment);
}

/* Everybody who had a cable to it has lost a link. */
static void lose_lower_ends(struct segment *seg, size_t slave)
{
	for (size_t i = 0; i < seg->count; i++) {
		if (seg->node[i].parent == (int)slave && !seg->node[i].is_cut) {
			esc_count_error(&seg->node[i].esc, 0, ESC_ERROR_LOST_LINK);
		}
	}
}

void segment_power_off(struct segment *segment, size_t slave, int64_t t_ns)
{
	struct node *n = &segment->node[slave];

	segment_advance(segment, t_ns);
	if (n->has_power) {
		n->has_power = 0;
		if (!n->is_cut) {
			lose_upper_end(segment, n);
		}
		lose_lower_ends(segment, slave);
		segment_find_paths(segment);
	}
}

void segment_power_on(struct segment *segment, size_t slave, int64_t t_ns)
{
	segment_advance(segment, t_ns);
	if (!segment->node[slave].has_power) {
		segment_start_node(&segment->node[slave], t_ns, 0);
		segment_find_paths(segment);
	}
}

void segment_drift(struct segment *segment, size_t slave, double ppm, int64_t t_ns)
{
	struct node *n = &segment->node[slave];

	segment_advance(segment, t_ns);
	n->ppm = ppm;
	if (n->has_power) {
		esc_clock_drift(&n->esc, t_ns, ppm + n->wandered_ppm);
		segment_plan(n);
	}
}

void segment_reset(struct segment *segment, size_t slave, int64_t t_ns)
{
	segment_advance(segment, t_ns);
	if (segment->node[slave].has_power) {
		segment_start_node(&segment->node[slave], t_ns, 0);
		segment_find_paths(segment);
	}
}
