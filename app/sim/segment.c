/* SPDX-License-Identifier: MIT */
#include "sim/segment.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum { DATAGRAMS_MAX = 128, NO_CHILD = -1 };

struct node {
	struct segment *segment;
	struct esc esc;
	struct esc_features features;
	struct sim_device *device;
	struct signal_spec signal;
	uint8_t *sii;
	size_t sii_bytes;
	double ppm;
	uint64_t clock_start_ns;
	int parent;
	unsigned parent_port;
	int child[4];
	int64_t wire_ns;
	int64_t processing_ns;
	int64_t forwarding_ns;
	int has_power;
	int is_cut;           /* the cable towards the parent */
	struct esc_frame way; /* when a frame passes, from the time it leaves the master */
	int64_t next_ns;      /* of its ESC and its device */
};

struct segment {
	struct node *node;
	size_t count;
	unsigned order[LIMIT_SLAVES]; /* in which a frame meets them */
	size_t reached;
	int64_t round_trip_ns;
	int64_t now_ns;
	void (*sink)(void *ctx, unsigned slave, int64_t t_ns, uint64_t system_time_ns);
	void *sink_ctx;
};

/* --- the way of a frame --- */

static int has_link(const struct segment *seg, int child)
{
	return child != NO_CHILD && seg->node[child].has_power && !seg->node[child].is_cut;
}

/* Depth first in the chip's port order 0, 3, 1, 2 (data sheet, frame processing order). */
static int64_t visit(struct segment *seg, unsigned i, int64_t at_ns)
{
	static const unsigned port_order[] = { 3, 1, 2 };
	struct node *n = &seg->node[i];
	int64_t t = at_ns + n->processing_ns;
	uint8_t links = 1;

	n->way = (struct esc_frame){ .pu_ns = at_ns, .port_ns = { at_ns }, .ports_used = 1 };
	seg->order[seg->reached++] = i;
	for (unsigned k = 0; k < 3; k++) {
		unsigned port = port_order[k];

		if (!has_link(seg, n->child[port])) {
			continue;
		}
		links |= (uint8_t)(1u << port);
		if (esc_is_port_closed(&n->esc, port)) {
			continue;
		}
		t += seg->node[n->child[port]].wire_ns;
		t = visit(seg, (unsigned)n->child[port], t) + seg->node[n->child[port]].wire_ns;
		n->way.port_ns[port] = t;
		n->way.ports_used |= (uint8_t)(1u << port);
		t += n->forwarding_ns;
	}
	esc_set_links(&n->esc, links);
	n->esc.is_loop_changed = 0;
	return t;
}

static void lay_way(struct segment *seg)
{
	seg->reached = 0;
	seg->round_trip_ns = 0;
	for (size_t i = 0; i < seg->count; i++) {
		struct node *n = &seg->node[i];

		if (n->parent < 0 && n->has_power && !n->is_cut) {
			seg->round_trip_ns = visit(seg, (unsigned)i, n->wire_ns) + n->wire_ns;
			return;
		}
	}
}

/* --- events --- */

static void plan(struct node *n)
{
	int64_t wake = n->device != NULL ? n->device->ops->next_wake_ns(n->device) : INT64_MAX;
	int64_t own = esc_next_event_ns(&n->esc);

	n->next_ns = !n->has_power ? INT64_MAX : wake < own ? wake : own;
}

static void sync0_edge(void *ctx, int64_t t_ns, uint64_t system_time_ns)
{
	struct node *n = ctx;
	struct segment *seg = n->segment;

	if (n->device != NULL) {
		n->device->ops->sync0(n->device, t_ns, system_time_ns);
	}
	if (seg->sink != NULL) {
		seg->sink(seg->sink_ctx, (unsigned)(n - seg->node), t_ns, system_time_ns);
	}
}

static void run_node(struct node *n, int64_t until_ns)
{
	while (n->next_ns <= until_ns) {
		int64_t at = n->next_ns;

		esc_advance(&n->esc, at);
		if (n->device != NULL && n->device->ops->next_wake_ns(n->device) <= at) {
			n->device->ops->run(n->device, at);
		}
		plan(n);
	}
}

static struct node *earliest(const struct segment *seg)
{
	struct node *best = &seg->node[0];

	for (size_t i = 1; i < seg->count; i++) {
		if (seg->node[i].next_ns < best->next_ns) {
			best = &seg->node[i];
		}
	}
	return best;
}

int64_t segment_next_event_ns(const struct segment *segment)
{
	return earliest(segment)->next_ns;
}

void segment_advance(struct segment *segment, int64_t t_ns)
{
	for (struct node *n = earliest(segment); n->next_ns <= t_ns; n = earliest(segment)) {
		run_node(n, n->next_ns);
	}
	if (t_ns > segment->now_ns) {
		segment->now_ns = t_ns;
	}
}

/* --- frames --- */

static int is_ethercat(const uint8_t *frame, size_t frame_len)
{
	return frame_len >= ECAT_ETHERNET_BYTES && frame[12] == ECAT_ETHERTYPE >> 8 &&
	       frame[13] == (ECAT_ETHERTYPE & 0xff);
}

static int find_datagrams(uint8_t *frame, size_t frame_len, struct ecat_datagram *dg)
{
	size_t pos = 0;
	int count = 0;
	int r;

	if (!ecat_frame_is_valid(frame, frame_len)) {
		return -1;
	}
	while ((r = ecat_frame_next(frame, frame_len, &pos, &dg[count])) == 1) {
		if (++count == DATAGRAMS_MAX) {
			return -1;
		}
	}
	return r < 0 ? -1 : count;
}

/* The first slave finds it and spoils the check sum, by which the others know that it was found. */
static void count_damaged(struct segment *seg)
{
	for (size_t k = 0; k < seg->reached; k++) {
		esc_count_error(&seg->node[seg->order[k]].esc, 0,
				k == 0 ? ESC_ERROR_UNIT : ESC_ERROR_FORWARDED);
	}
}

static int pass(struct node *n, int64_t t_ns, struct ecat_datagram *dg, int count)
{
	struct esc_frame way = n->way;

	way.pu_ns += t_ns;
	for (unsigned port = 0; port < ESC_PORTS; port++) {
		way.port_ns[port] += t_ns;
	}
	run_node(n, way.pu_ns);
	for (int i = 0; i < count; i++) {
		esc_datagram(&n->esc, &way, &dg[i]);
	}
	if (n->device != NULL && n->device->ops->frame_passed != NULL) {
		n->device->ops->frame_passed(n->device, way.pu_ns);
	}
	plan(n);
	return n->esc.is_loop_changed;
}

int segment_frame(struct segment *segment, int64_t t_ns, uint8_t *frame, size_t frame_len,
		  int64_t *ret_back_ns)
{
	struct ecat_datagram dg[DATAGRAMS_MAX];
	int is_loop_changed = 0;
	int count;

	segment_advance(segment, t_ns);
	if (segment->reached == 0) {
		return -ENOLINK;
	}
	if (!is_ethercat(frame, frame_len)) {
		return -EBADMSG; /* not theirs: slaves take it off the wire (0x0100 bit 0) */
	}
	count = find_datagrams(frame, frame_len, dg);
	if (count < 0) {
		count_damaged(segment);
		return -EBADMSG;
	}
	for (size_t k = 0; k < segment->reached; k++) {
		is_loop_changed |= pass(&segment->node[segment->order[k]], t_ns, dg, count);
	}
	frame[6] |= 0x02; /* every ESC marks the source address of what it has processed */
	*ret_back_ns = t_ns + segment->round_trip_ns;
	if (is_loop_changed) {
		lay_way(segment);
	}
	return 0;
}

/* --- making and breaking --- */

static void power_on(struct node *n, int64_t t_ns, uint64_t clock_start_ns)
{
	n->has_power = 1;
	esc_init(&n->esc, &n->features, n->sii, n->sii_bytes, t_ns);
	esc_clock_start(&n->esc, t_ns, clock_start_ns, n->ppm);
	esc_sync0_to(&n->esc, sync0_edge, n);
	if (n->device != NULL) {
		n->device->esc = &n->esc;
		n->device->signal = &n->signal;
		n->device->ops->power_on(n->device, t_ns);
	}
	plan(n);
}

/* The first slave hangs on the master, every other one on a free port of one before it. */
static int is_place_free(const struct segment *seg, unsigned i,
			 const struct segment_slave_spec *spec)
{
	if (i == 0 || spec->parent < 0) {
		return i == 0 && spec->parent < 0;
	}
	return spec->parent < (int)i && spec->parent_port >= 1 && spec->parent_port < ESC_PORTS &&
	       seg->node[spec->parent].child[spec->parent_port] == NO_CHILD;
}

static int add_slave(struct segment *seg, unsigned i, const struct segment_slave_spec *spec)
{
	struct node *n = &seg->node[i];

	*n = (struct node){
		.segment = seg,
		.features = *spec->features,
		.device = spec->device,
		.signal = spec->signal,
		.ppm = spec->ppm,
		.clock_start_ns = spec->clock_start_ns,
		.parent = spec->parent,
		.parent_port = spec->parent_port,
		.child = { NO_CHILD, NO_CHILD, NO_CHILD, NO_CHILD },
		.wire_ns = spec->wire_ns,
		.processing_ns = spec->processing_ns,
		.forwarding_ns = spec->forwarding_ns,
		.sii_bytes = spec->sii_bytes,
	};
	if (spec->sii_bytes > SEGMENT_SII_BYTES || !is_place_free(seg, i, spec)) {
		return -EINVAL;
	}
	n->sii = malloc(spec->sii_bytes > 0 ? spec->sii_bytes : 1);
	if (n->sii == NULL) {
		return -ENOMEM;
	}
	memcpy(n->sii, spec->sii, spec->sii_bytes);
	if (spec->parent >= 0) {
		seg->node[spec->parent].child[spec->parent_port] = (int)i;
	}
	return 0;
}

static void destroy_devices(const struct segment_slave_spec *slaves, size_t from, size_t count)
{
	for (size_t i = from; i < count; i++) {
		if (slaves[i].device != NULL) {
			slaves[i].device->ops->destroy(slaves[i].device);
		}
	}
}

int segment_create(const struct segment_slave_spec *slaves, size_t count, int64_t t_ns,
		   struct segment **ret_segment)
{
	int is_count_right = count >= 1 && count <= LIMIT_SLAVES;
	struct segment *seg = calloc(1, sizeof(*seg));
	int r = 0;

	if (seg != NULL && is_count_right) {
		seg->node = calloc(count, sizeof(*seg->node));
	}
	if (seg == NULL || seg->node == NULL) {
		free(seg);
		destroy_devices(slaves, 0, count);
		return is_count_right ? -ENOMEM : -EINVAL;
	}
	seg->now_ns = t_ns;
	for (unsigned i = 0; i < count && r == 0; i++) {
		r = add_slave(seg, i, &slaves[i]);
		seg->count = i + 1u;
	}
	if (r < 0) {
		destroy_devices(slaves, seg->count, count);
		segment_destroy(seg);
		return r;
	}
	for (size_t i = 0; i < count; i++) {
		power_on(&seg->node[i], t_ns, seg->node[i].clock_start_ns);
	}
	lay_way(seg);
	*ret_segment = seg;
	return 0;
}

void segment_destroy(struct segment *segment)
{
	if (segment == NULL) {
		return;
	}
	for (size_t i = 0; i < segment->count; i++) {
		struct node *n = &segment->node[i];

		if (n->device != NULL) {
			n->device->ops->destroy(n->device);
		}
		free(n->sii);
	}
	free(segment->node);
	free(segment);
}

static void lose_link(struct segment *seg, const struct node *n)
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
		lose_link(segment, n);
		esc_count_error(&n->esc, 0, ESC_ERROR_LOST_LINK);
		lay_way(segment);
	}
}

void segment_heal(struct segment *segment, size_t slave, int64_t t_ns)
{
	segment_advance(segment, t_ns);
	segment->node[slave].is_cut = 0;
	lay_way(segment);
}

void segment_power_off(struct segment *segment, size_t slave, int64_t t_ns)
{
	struct node *n = &segment->node[slave];

	segment_advance(segment, t_ns);
	if (n->has_power) {
		n->has_power = 0;
		n->next_ns = INT64_MAX;
		lose_link(segment, n);
		lay_way(segment);
	}
}

void segment_power_on(struct segment *segment, size_t slave, int64_t t_ns)
{
	segment_advance(segment, t_ns);
	if (!segment->node[slave].has_power) {
		power_on(&segment->node[slave], t_ns, 0);
		lay_way(segment);
	}
}

size_t segment_slave_count(const struct segment *segment)
{
	return segment->count;
}

struct esc *segment_esc(struct segment *segment, size_t slave)
{
	return &segment->node[slave].esc;
}

struct sim_device *segment_device(struct segment *segment, size_t slave)
{
	return segment->node[slave].device;
}

int64_t segment_now_ns(const struct segment *segment)
{
	return segment->now_ns;
}

void segment_sync0_to(struct segment *segment,
		      void (*sink)(void *ctx, unsigned slave, int64_t t_ns,
				   uint64_t system_time_ns),
		      void *ctx)
{
	segment->sink = sink;
	segment->sink_ctx = ctx;
}
