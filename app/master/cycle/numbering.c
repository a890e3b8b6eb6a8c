/* SPDX-License-Identifier: MIT */
#include "cycle/numbering.h"

#include "base/clock.h"

/* A frame this far from its edge is not late: the reference clock is another one. */
#define FAR_EDGES 100000

void numbering_init(struct numbering *numbering, int64_t period_ns, int64_t settle_ns)
{
	*numbering = (struct numbering){ .period_ns = period_ns, .settle_ns = settle_ns };
}

uint64_t numbering_skipped(int64_t period_ns, int64_t set_point_ns, int64_t late_ns)
{
	int64_t since_edge_ns = late_ns + set_point_ns;

	return since_edge_ns < period_ns ? 0 : (uint64_t)(since_edge_ns / period_ns);
}

static void lay_grid(struct numbering *numbering, uint64_t cycle, int64_t frame_dc_ns)
{
	int64_t edge_ns = frame_dc_ns - mod_floor(frame_dc_ns, numbering->period_ns);

	numbering->base_ns = edge_ns - (int64_t)cycle * numbering->period_ns;
	numbering->has_base = 1;
	numbering->off_grid = 0;
}

struct numbering_place numbering_place(struct numbering *numbering, uint64_t cycle,
				       int64_t frame_dc_ns)
{
	struct numbering_place place = { .passed_edges = 0, .is_in_window = 1, .was_rebased = 0 };
	int64_t since_edge_ns;

	if (!numbering->has_base) {
		lay_grid(numbering, cycle, frame_dc_ns);
	}
	since_edge_ns = frame_dc_ns - numbering_dc_time(numbering, cycle);
	if (since_edge_ns < 0 || since_edge_ns / numbering->period_ns > FAR_EDGES) {
		place.is_in_window = 0;
		if (++numbering->off_grid >= NUMBERING_REBASE_CYCLES) {
			lay_grid(numbering, cycle, frame_dc_ns);
			place.was_rebased = 1;
		}
		return place;
	}
	numbering->off_grid = 0;
	place.passed_edges = (uint64_t)(since_edge_ns / numbering->period_ns);
	place.is_in_window = since_edge_ns % numbering->period_ns >= numbering->settle_ns;
	return place;
}

int64_t numbering_dc_time(const struct numbering *numbering, uint64_t cycle)
{
	return numbering->has_base ? numbering->base_ns + (int64_t)cycle * numbering->period_ns : 0;
}
