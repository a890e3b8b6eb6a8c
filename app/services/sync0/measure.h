/* SPDX-License-Identifier: MIT */
/* Measure one line in one window. Context: any; not RT-safe (it sorts). */
#ifndef SYNC0_MEASURE_H
#define SYNC0_MEASURE_H

#include <stdint.h>

#include "base/sync0.h"
#include "sync0/grid.h"
#include "sync0/judge.h"
#include "sync0/window.h"

struct measure_spec {
	int64_t period_ns;          /* of the cycles */
	int64_t origin_dc_ns;       /* DC time of cycle 0 */
	const struct grid_row *row; /* of this line, and of the first; with their shifts in them */
	const struct grid_row *first_row;
	int64_t shift_ns;
	int64_t first_shift_ns;
};

/* Scratch arrays, one element per cycle or pulse of a window, allocated once. */
struct measure_scratch {
	uint32_t *x;
	int64_t *y;
	int64_t *scratch;
};

int measure_scratch_create(uint32_t count, struct measure_scratch *ret_scratch);
void measure_scratch_destroy(struct measure_scratch *scratch);

/**
 * Fill counts and figures of @ret from line @number of @w. Nothing is judged yet.
 */
void measure_window(const struct window *w, size_t number, const struct measure_spec *spec,
		    const struct judge_noise *noise, const struct measure_scratch *scratch,
		    struct sync0_result *ret);

#endif
