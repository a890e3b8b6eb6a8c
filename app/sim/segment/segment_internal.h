/* SPDX-License-Identifier: MIT */
/* Between the files of the segment; not for others. */
#ifndef SIM_SEGMENT_SEGMENT_INTERNAL_H
#define SIM_SEGMENT_SEGMENT_INTERNAL_H

#include "base/prng.h"
#include "segment/event_queue.h"
#include "segment/frame_path.h"
#include "segment/segment.h"

struct node {
	struct segment *segment;
	struct esc esc;
	struct esc_features features;
	struct sim_device *device;
	struct signal_spec signal;
	uint8_t *sii;
	size_t sii_bytes;
	double ppm;
	double wander_ppm;   /* limit */
	double wandered_ppm; /* now */
	uint64_t clock_start_ns;
	struct prng prng;
	int64_t jitter_ns;
	int parent;
	unsigned parent_port;
	int64_t wire_ns;
	int has_power;
	int is_cut;       /* the cable towards the parent */
	int is_unplugged; /* out of the line: its neighbours are connected to each other */
	int64_t next_wander_ns;
	int64_t chip_ns; /* of those of its slave controller */
	int64_t next_ns; /* of all of its own events */
};

struct segment {
	struct node *node;
	size_t count;
	struct event_queue queue; /* next_ns of each */
	struct path_node *wiring;
	struct frame_path path[SEGMENT_PORTS];
	int first;      /* the slave at the primary port */
	int ring_slave; /* at the secondary port; PATH_NOWHERE: no ring */
	unsigned ring_port;
	int64_t ring_wire_ns;
	int is_ring_cut;
	int64_t now_ns;
	int64_t wire_free_ns[SEGMENT_PORTS];
	void (*sink)(void *ctx, unsigned slave, int64_t t_ns, uint64_t system_time_ns);
	void *sink_ctx;
};

/** When does anything of this slave happen next? Call after whatever may change it. */
void segment_plan(struct node *n);
/** Run the slave's events up to and including @t_ns. */
void segment_run_node(struct node *n, int64_t t_ns);
/** Compute both paths again: a link or a loop has changed. */
void segment_find_paths(struct segment *segment);
/** Power-on reset of one slave. */
void segment_start_node(struct node *n, int64_t t_ns, uint64_t clock_ns);

#endif
