/* SPDX-License-Identifier: MIT */
#include "sync0/grid.h"

#include <stdlib.h>

#include "base/clock.h"
#include "base/timemap.h"

/* So many pairs in a row, all on one side and alike, are a step and not a few late wakes. */
enum { STEP_PAIRS = 16 };

/* The map may be off by this while it learns the rate of a pair of crystals 200 ppm apart. */
#define LEARNING_NS (NS_PER_MS / 4)

struct grid {
	struct timemap *map;
	int64_t period_ns;
	int64_t origin_dc_ns;
	int64_t off_ns[STEP_PAIRS];
	int off_count;
};

struct grid *grid_create(int64_t period_ns)
{
	struct grid *grid = calloc(1, sizeof(*grid));

	if (grid == NULL) {
		return NULL;
	}
	grid->period_ns = period_ns;
	grid->map = timemap_create(0);
	if (grid->map == NULL) {
		free(grid);
		return NULL;
	}
	return grid;
}

void grid_destroy(struct grid *grid)
{
	if (grid != NULL) {
		timemap_destroy(grid->map);
		free(grid);
	}
}

void grid_set_origin(struct grid *grid, int64_t dc_ns)
{
	grid->origin_dc_ns = dc_ns;
}

/* The pairs show that a clock stepped: the spread between them is small beside their distance. */
static int is_step(const struct grid *grid, int64_t *ret_step_ns)
{
	int64_t low = grid->off_ns[0];
	int64_t high = grid->off_ns[0];

	for (int i = 1; i < STEP_PAIRS; i++) {
		low = grid->off_ns[i] < low ? grid->off_ns[i] : low;
		high = grid->off_ns[i] > high ? grid->off_ns[i] : high;
	}
	*ret_step_ns = low / 2 + high / 2;
	return high - low < llabs(*ret_step_ns) / 2;
}

static int looks_stepped(struct grid *grid, int64_t off_ns, int64_t latency_ns)
{
	int64_t limit_ns = grid->period_ns / 4 > LEARNING_NS ? grid->period_ns / 4 : LEARNING_NS;

	if (llabs(off_ns) <= limit_ns + latency_ns ||
	    (grid->off_count > 0 && (off_ns < 0) != (grid->off_ns[0] < 0))) {
		grid->off_count = 0;
		return 0;
	}
	if (grid->off_count == STEP_PAIRS) {
		for (int i = 1; i < STEP_PAIRS; i++) {
			grid->off_ns[i - 1] = grid->off_ns[i];
		}
		grid->off_count--;
	}
	grid->off_ns[grid->off_count++] = off_ns;
	return grid->off_count == STEP_PAIRS;
}

enum grid_change grid_pair(struct grid *grid, int64_t dc_ns, int64_t mono_ns, int64_t latency_ns,
			   int64_t *ret_step_ns)
{
	enum grid_change change = GRID_QUIET;
	int64_t step_ns;

	if (timemap_is_ready(grid->map) &&
	    looks_stepped(grid, mono_ns - timemap_utc_ns(grid->map, dc_ns), latency_ns) &&
	    is_step(grid, &step_ns)) {
		struct timemap *map = timemap_create(0);

		if (map != NULL) {
			timemap_destroy(grid->map);
			grid->map = map;
			grid->off_count = 0;
			*ret_step_ns = step_ns;
			change = GRID_STEPPED;
		}
	}
	timemap_feed(grid->map, dc_ns, mono_ns, latency_ns);
	return change;
}

int grid_is_ready(const struct grid *grid)
{
	return timemap_is_ready(grid->map);
}

int64_t grid_mono_ns(const struct grid *grid, int64_t dc_ns)
{
	return timemap_utc_ns(grid->map, dc_ns);
}

int64_t grid_uncertainty_ns(const struct grid *grid)
{
	struct timemap_state s;

	timemap_get(grid->map, &s);
	return s.uncertainty_ns;
}

int64_t grid_due_dc_ns(const struct grid *grid, int64_t cycle)
{
	return grid->origin_dc_ns + cycle * grid->period_ns;
}

static int64_t dc_ns_at(const struct grid *grid, int64_t mono_ns)
{
	struct timemap_state s;
	int64_t since;

	timemap_get(grid->map, &s);
	since = mono_ns - s.utc_ns;
	return s.dc_ns + since -
	       (int64_t)((double)since * (double)s.rate_ppb / (1e9 + (double)s.rate_ppb));
}

int64_t grid_row_pulse(const struct grid_row *row, int64_t mono_ns, int64_t shift_ns,
		       int64_t *ret_late_ns)
{
	int64_t since = dc_ns_at(row->grid, mono_ns) - row->origin_dc_ns;
	int64_t folded = fold_ns(since - shift_ns, row->period_ns);

	*ret_late_ns = folded + shift_ns;
	return (since - shift_ns - folded) / row->period_ns;
}

int64_t grid_cycle(const struct grid *grid, int64_t mono_ns)
{
	const struct grid_row cycles = { grid, grid->period_ns, grid->origin_dc_ns };
	int64_t late_ns;

	return grid_row_pulse(&cycles, mono_ns, 0, &late_ns);
}
