/* SPDX-License-Identifier: MIT */
/*
 * Cycles where there is no master: the edges of the first line are counted, or, where the source
 * knows DC time (a simulation), placed by it. Context: any.
 */
#ifndef SYNC0_SELF_GRID_H
#define SYNC0_SELF_GRID_H

#include <stdint.h>

#include "sync0/edge.h"

enum { SELF_GRID_ASTRAY = 8 };

struct self_grid {
	int has_begun;
	int64_t cycle;
	int64_t mono_ns;
	int64_t first_dc_ns;
	int astray;
};

struct self_cycle {
	int64_t cycle;
	int64_t dc_ns; /* of its due time */
};

/** 1 if @edge is that of a cycle, which is put into *ret; 0 if it is an odd one. */
int self_grid_edge(struct self_grid *sg, int64_t period_ns, const struct edge *edge,
		   struct self_cycle *ret);

#endif
