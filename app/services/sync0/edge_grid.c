/* SPDX-License-Identifier: MIT */
#include "sync0/edge_grid.h"

#include "base/clock.h"

enum { NEAR_SHARE = 8 }; /* of the period: an edge within it of a whole number of periods counts */

/* DC time as if cycle 0 were at this one: any will do, and no sum of it overflows. */
#define ORIGIN_DC_NS NS_PER_S

static int begin(struct edge_grid *sg, const struct edge *edge, struct edge_cycle *ret)
{
	sg->has_begun = 1;
	sg->first_dc_ns = edge->dc_ns != 0 ? edge->dc_ns : ORIGIN_DC_NS;
	sg->mono_ns = edge->mono_ns;
	ret->cycle = 0;
	ret->dc_ns = sg->first_dc_ns;
	return 1;
}

/*
 * After several edges in a row that do not fit, the clock has stepped: each edge was a cycle.
 * Cycles lost in the step itself cannot be found from edges alone.
 */
static int count(struct edge_grid *sg, int64_t period_ns, int64_t mono_ns)
{
	int64_t since_ns = mono_ns - sg->mono_ns;
	int64_t off_ns = fold_ns(since_ns, period_ns);
	int64_t periods = (since_ns - off_ns) / period_ns;

	if (periods >= 1 && off_ns > -period_ns / NEAR_SHARE && off_ns < period_ns / NEAR_SHARE) {
		sg->cycle += periods;
		sg->misses = 0;
		return 1;
	}
	if (++sg->misses < EDGE_GRID_MISSES) {
		return 0;
	}
	sg->cycle += sg->misses;
	sg->misses = 0;
	return 1;
}

int edge_grid_take(struct edge_grid *sg, int64_t period_ns, const struct edge *edge,
		   struct edge_cycle *ret)
{
	if (!sg->has_begun) {
		return begin(sg, edge, ret);
	}
	if (edge->dc_ns != 0) {
		int64_t since_ns = edge->dc_ns - sg->first_dc_ns;

		sg->cycle = (since_ns - fold_ns(since_ns, period_ns)) / period_ns;
	} else if (!count(sg, period_ns, edge->mono_ns)) {
		return 0;
	}
	sg->mono_ns = edge->mono_ns;
	ret->cycle = sg->cycle;
	ret->dc_ns = sg->first_dc_ns + sg->cycle * period_ns;
	return 1;
}
