/* SPDX-License-Identifier: MIT */
/*
 * Cycle k is SYNC0 edge k: a grid in DC time, dc_time(k) = base + k * period. A frame's own DC time
 * identifies the edge of its inputs, so a master that wakes late still numbers them correctly.
 * Context: cycle thread, RT-safe.
 */
#ifndef CYCLE_NUMBERING_H
#define CYCLE_NUMBERING_H

#include <stdint.h>

enum {
	NUMBERING_SKIP_LIMIT = 1000,   /* skipped cycles that get a sample each; above, the numbers
					  jump */
	NUMBERING_REBASE_CYCLES = 100, /* this many consecutive frames off the grid: the reference
					  has changed */
};

struct numbering {
	int64_t period_ns;
	int64_t settle_ns; /* after an edge, until the slaves' inputs are in place */
	int has_base;
	int64_t base_ns;   /* DC time of edge 0 */
	uint64_t next;     /* number of the next cycle */
	unsigned off_grid; /* frames in a row that passed before their edge, or years after it */
};

struct numbering_place {
	uint64_t passed_edges; /* edges between the cycle's own and the one the frame belongs to */
	int is_in_window;      /* not within settle_ns after an edge, nor before the cycle's own */
	int was_rebased;       /* the grid was rebased: the reference clock jumped */
};

void numbering_init(struct numbering *numbering, int64_t period_ns, int64_t settle_ns);

/** How many edges a wake @late_ns after the deadline has passed over. */
uint64_t numbering_skipped(int64_t period_ns, int64_t set_point_ns, int64_t late_ns);

/** Place the frame of @cycle that passed at @frame_dc_ns. The first one sets the grid. */
struct numbering_place numbering_place(struct numbering *numbering, uint64_t cycle,
				       int64_t frame_dc_ns);

/** DC time of the edge of @cycle; 0 while there is no grid. */
int64_t numbering_dc_time(const struct numbering *numbering, uint64_t cycle);

#endif
