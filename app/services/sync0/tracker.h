/* SPDX-License-Identifier: MIT */
/*
 * Gives each edge of one line the number of the pulse that it is. A line has a phase against its
 * row, learnt from its first edges and followed slowly; an edge within a quarter of the period of
 * it is a pulse's, any other is held until it is clear whether it is an extra one or the phase
 * has stepped. A smaller step shows as one odd interval with all edges behind it on one side.
 * Context: any.
 */
#ifndef SYNC0_TRACKER_H
#define SYNC0_TRACKER_H

#include <stdint.h>

#include "sync0/edge.h"
#include "sync0/grid.h"

enum { TRACKER_HELD = 8 };

struct tracker {
	int is_locked;
	double phase_ns; /* behind the due time */
	int has_last;
	int64_t last_pulse;
	int64_t last_mono_ns;            /* of the newest edge of a pulse */
	double run_off_ns[TRACKER_HELD]; /* edges in a row on one side of the phase */
	double run_jump_ns; /* by how much the interval before the first of them was off */
	unsigned run_count;
	struct edge held[TRACKER_HELD];
	int64_t held_late_ns[TRACKER_HELD];
	int held_count;
};

enum tracker_kind { TRACKER_PULSE, TRACKER_EXTRA };

struct tracker_item {
	enum tracker_kind kind;
	int64_t pulse; /* for TRACKER_EXTRA, the one nearest to it */
	int64_t mono_ns;
};

struct tracker_out {
	int count;
	struct tracker_item item[TRACKER_HELD + 1];
	int64_t step_ns;    /* the line's phase stepped by so much; 0: not */
	int64_t step_pulse; /* the first pulse after it */
};

/** Forget everything: the grid has changed. */
void tracker_reset(struct tracker *track);
/** Take @edge; what has become clear by it is in @ret_out, oldest first. */
void tracker_edge(struct tracker *track, const struct grid_row *row, const struct edge *edge,
		  struct tracker_out *ret_out);
/** What is still held is extra. */
void tracker_finish(struct tracker *track, const struct grid_row *row, struct tracker_out *ret_out);

#endif
