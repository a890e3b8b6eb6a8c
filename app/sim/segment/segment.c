/* SPDX-License-Identifier: MIT */
#include "segment/segment.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "segment/segment_internal.h"

enum { WANDER_STEP_NS = 50000000, WANDER_STEPS = 40 };

/* --- events --- */

static void plan(struct node *n)
{
	int64_t next = esc_next_event_ns(&n->esc);

	n->chip_ns = next;
	if (!n->has_power) {
		n->next_ns = INT64_MAX;
		return;
	}
	if (n->device != NULL) {
		int64_t wake = n->device->ops->next_wake_ns(n->device);

		next = wake < next ? wake : next;
	}
	n->next_ns = n->next_wander_ns < next ? n->next_wander_ns : next;
}

static void enqueue(const struct node *n)
{
	event_queue_set(&n->segment->queue, (size_t)(n - n->segment->node), n->next_ns);
}

void segment_plan(struct node *n)
{
	plan(n);
	enqueue(n);
}

/* A bounded random walk: the crystal in the draught. */
static void wander(struct node *n)
{
	double step = n->wander_ppm / WANDER_STEPS * (2.0 * prng_unit(&n->prng) - 1.0);
	double to = n->wandered_ppm + step;

	if (to > n->wander_ppm || to < -n->wander_ppm) {
		to = n->wandered_ppm - step;
	}
	n->wandered_ppm = to;
	esc_clock_drift(&n->esc, n->next_wander_ns, n->ppm + to);
	n->next_wander_ns += WANDER_STEP_NS;
}

static void run_next(struct node *n)
{
	int64_t at = n->next_ns;

	if (at >= n->next_wander_ns) {
		wander(n);
		n->chip_ns = esc_next_event_ns(&n->esc);
	}
	if (at >= n->chip_ns) {
		esc_advance(&n->esc, at);
	}
	if (n->device != NULL && n->device->ops->next_wake_ns(n->device) <= at) {
		n->device->ops->run(n->device, at);
	}
	if (esc_take_reset(&n->esc)) {
		segment_start_node(n, at, 0);
	}
	plan(n);
}

void segment_run_node(struct node *n, int64_t t_ns)
{
	while (n->next_ns <= t_ns) {
		run_next(n);
	}
}

static struct node *earliest(const struct segment *seg)
{
	return &seg->node[event_queue_first(&seg->queue)];
}

int64_t segment_next_event_ns(const struct segment *segment)
{
	return earliest(segment)->next_ns;
}

/*
 * Of what slaves do by themselves only the SYNC0 edges, which go to the sink, are in order among
 * slaves. So one runs on until its next edge.
 */
void segment_advance(struct segment *segment, int64_t t_ns)
{
	for (struct node *n = earliest(segment); n->next_ns <= t_ns; n = earliest(segment)) {
		do {
			run_next(n);
		} while (n->next_ns <= t_ns && n->next_ns < n->esc.sync.next_true_ns);
		enqueue(n);
	}
	if (t_ns > segment->now_ns) {
		segment->now_ns = t_ns;
	}
}

static void sync0_edge(void *ctx, int64_t t_ns, uint64_t system_time_ns)
{
	struct node *n = ctx;
	struct segment *seg = n->segment;

	if (n->device != NULL && esc_has_sync0_pin(&n->esc)) {
		n->device->ops->sync0(n->device, t_ns, system_time_ns);
	}
	if (seg->sink != NULL) {
		seg->sink(seg->sink_ctx, (unsigned)(n - seg->node), t_ns, system_time_ns);
	}
}

void segment_sync0_to(struct segment *segment,
		      void (*sink)(void *ctx, unsigned slave, int64_t t_ns,
				   uint64_t system_time_ns),
		      void *ctx)
{
	segment->sink = sink;
	segment->sink_ctx = ctx;
}

/* --- wiring --- */

static int is_live(const struct segment *seg, int slave)
{
	return slave != PATH_NOWHERE && seg->node[slave].has_power;
}

/* Both ends see the link; each may still hold its loop closed (DL control). */
static void set_links(struct segment *seg)
{
	for (size_t i = 0; i < seg->count; i++) {
		struct node *n = &seg->node[i];
		uint8_t links = 0;

		for (unsigned port = 0; port < PATH_PORTS; port++) {
			const struct path_link *l = &seg->wiring[i].link[port];
			int is_cut = port == 0 ? n->is_cut : 0;

			if (l->is_master && l->master == SEGMENT_SECONDARY) {
				is_cut = seg->is_ring_cut;
			} else if (port != 0 && l->slave != PATH_NOWHERE) {
				is_cut = seg->node[l->slave].is_cut;
			}
			if (!is_cut && (l->is_master || is_live(seg, l->slave))) {
				links |= (uint8_t)(1u << port);
			}
		}
		esc_set_links(&n->esc, n->has_power && !n->is_unplugged ? links : 0);
		n->esc.is_loop_changed = 0;
		for (unsigned port = 0; port < PATH_PORTS; port++) {
			seg->wiring[i].link[port].is_open =
				(links >> port & 1) && !esc_is_port_closed(&n->esc, port);
		}
	}
}

void segment_find_paths(struct segment *segment)
{
	const struct node *first = &segment->node[segment->first];
	int has_ring = segment->ring_slave != PATH_NOWHERE && !segment->is_ring_cut &&
		       segment->node[segment->ring_slave].has_power;

	set_links(segment);
	memset(segment->path, 0, sizeof(segment->path));
	if (segment_is_up(segment, SEGMENT_PRIMARY) &&
	    segment->wiring[segment->first].link[0].is_open) {
		frame_path_find(segment->wiring, (unsigned)segment->first, 0, first->wire_ns,
				&segment->path[SEGMENT_PRIMARY]);
	}
	if (has_ring && segment->wiring[segment->ring_slave].link[segment->ring_port].is_open) {
		frame_path_find(segment->wiring, (unsigned)segment->ring_slave, segment->ring_port,
				segment->ring_wire_ns, &segment->path[SEGMENT_SECONDARY]);
	}
	for (size_t i = 0; i < segment->count; i++) {
		segment_plan(&segment->node[i]);
	}
}

int segment_is_up(const struct segment *segment, enum segment_port port)
{
	if (port == SEGMENT_SECONDARY) {
		return segment->ring_slave != PATH_NOWHERE && !segment->is_ring_cut &&
		       segment->node[segment->ring_slave].has_power;
	}
	return segment->node[segment->first].has_power && !segment->node[segment->first].is_cut;
}

int segment_close_ring(struct segment *segment, size_t slave, unsigned port, int64_t wire_ns)
{
	struct path_link *l;

	if (slave >= segment->count || port < 1 || port >= PATH_PORTS ||
	    segment->ring_slave != PATH_NOWHERE) {
		return -EINVAL;
	}
	l = &segment->wiring[slave].link[port];
	if (l->slave != PATH_NOWHERE || l->is_master) {
		return -EINVAL;
	}
	*l = (struct path_link){ .slave = PATH_NOWHERE,
				 .is_master = 1,
				 .master = SEGMENT_SECONDARY,
				 .wire_ns = wire_ns };
	segment->ring_slave = (int)slave;
	segment->ring_port = port;
	segment->ring_wire_ns = wire_ns;
	segment_find_paths(segment);
	return 0;
}

/* --- making --- */

void segment_start_node(struct node *n, int64_t t_ns, uint64_t clock_ns)
{
	const struct esc_al_fault al_fault = n->esc.al_fault;
	uint16_t identification = n->esc.identification;
	uint8_t links = n->esc.ports;

	n->has_power = 1;
	esc_init(&n->esc, &n->features, n->sii, n->sii_bytes, t_ns);
	esc_clock_start(&n->esc, t_ns, clock_ns, n->ppm + n->wandered_ppm);
	n->esc.al_fault = al_fault;
	n->esc.identification = identification;
	esc_sync0_to(&n->esc, sync0_edge, n);
	esc_set_links(&n->esc, links);
	n->next_wander_ns = n->wander_ppm > 0 ? t_ns + WANDER_STEP_NS : INT64_MAX;
	if (n->device != NULL) {
		n->device->esc = &n->esc;
		n->device->signal = &n->signal;
		n->device->ops->power_on(n->device, t_ns);
	}
	segment_plan(n);
}

static int connect(struct segment *seg, unsigned i, const struct segment_slave_spec *spec)
{
	struct path_link *up = &seg->wiring[i].link[0];
	struct path_link *down;

	*up = (struct path_link){ .slave = spec->parent,
				  .port = spec->parent_port,
				  .wire_ns = spec->wire_ns };
	if (spec->parent < 0) {
		/* One slave only is at the master's port. */
		up->slave = PATH_NOWHERE;
		up->is_master = 1;
		up->master = SEGMENT_PRIMARY;
		seg->first = (int)i;
		return i == 0 ? 0 : -EINVAL;
	}
	if (spec->parent >= (int)i || spec->parent_port < 1 || spec->parent_port >= PATH_PORTS) {
		return -EINVAL;
	}
	down = &seg->wiring[spec->parent].link[spec->parent_port];
	if (down->slave != PATH_NOWHERE) {
		return -EINVAL;
	}
	*down = (struct path_link){ .slave = (int)i, .port = 0, .wire_ns = spec->wire_ns };
	return 0;
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
		.wander_ppm = spec->wander_ppm,
		.clock_start_ns = spec->clock_start_ns,
		.prng = { .state = spec->seed },
		.jitter_ns = spec->jitter_ns,
		.parent = spec->parent,
		.parent_port = spec->parent_port,
		.wire_ns = spec->wire_ns,
		.sii_bytes = spec->sii_bytes,
	};
	seg->wiring[i].processing_ns = spec->processing_ns;
	seg->wiring[i].forwarding_ns = spec->forwarding_ns;
	if (spec->sii_bytes > SEGMENT_SII_BYTES || connect(seg, i, spec) < 0) {
		return -EINVAL;
	}
	n->sii = malloc(spec->sii_bytes > 0 ? spec->sii_bytes : 1);
	if (n->sii == NULL) {
		return -ENOMEM;
	}
	memcpy(n->sii, spec->sii, spec->sii_bytes);
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

static struct segment *allocate(size_t count)
{
	struct segment *seg = calloc(1, sizeof(*seg));

	if (seg == NULL) {
		return NULL;
	}
	seg->node = calloc(count, sizeof(*seg->node));
	seg->wiring = calloc(count, sizeof(*seg->wiring));
	if (seg->node == NULL || seg->wiring == NULL || event_queue_init(&seg->queue, count) < 0) {
		segment_destroy(seg);
		return NULL;
	}
	for (size_t i = 0; i < count * PATH_PORTS; i++) {
		seg->wiring[i / PATH_PORTS].link[i % PATH_PORTS].slave = PATH_NOWHERE;
	}
	seg->ring_slave = PATH_NOWHERE;
	return seg;
}

int segment_create(const struct segment_slave_spec *slaves, size_t count, int64_t t_ns,
		   struct segment **ret_segment)
{
	int is_count_right = count >= 1 && count <= LIMIT_SLAVES;
	struct segment *seg = is_count_right ? allocate(count) : NULL;
	int r = 0;

	if (seg == NULL) {
		destroy_devices(slaves, 0, count);
		return is_count_right ? -ENOMEM : -EINVAL;
	}
	seg->now_ns = t_ns;
	for (unsigned i = 0; r == 0 && i < count; i++) {
		r = add_slave(seg, i, &slaves[i]);
		seg->count = i + 1u;
	}
	if (r < 0) {
		destroy_devices(slaves, seg->count, count);
		segment_destroy(seg);
		return r;
	}
	for (size_t i = 0; i < count; i++) {
		segment_start_node(&seg->node[i], t_ns, seg->node[i].clock_start_ns);
	}
	segment_find_paths(seg);
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
	free(segment->wiring);
	event_queue_done(&segment->queue);
	free(segment);
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
