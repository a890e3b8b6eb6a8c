/* SPDX-License-Identifier: MIT */
/*
 * Cycles where there is no master: the edges of the first line are counted, or, where the source
 * knows DC time (a simulation), placed by it. Context: any.
 */
#ifndef SYNC0_EDGE_GRID_H
#define SYNC0_EDGE_GRID_H

#include <stdint.h>

#include "sync0/edge.h"

enum { EDGE_GRID_MISSES = 8 };

struct edge_grid {
	int has_begun;
	int64_t cycle;
	int64_t mono_ns;
	int64_t first_dc_ns;
	int misses;
};

struct edge_cycle {
	int64_t cycle;
	int64_t dc_ns; /* of its due time */
};

/** 1 if @edge is that of a cycle, which is put into *ret; 0 if it does not fit. */
int edge_grid_take(struct edge_grid *sg, int64_t period_ns, const struct edge *edge,
		   struct edge_cycle *ret);

#endif
