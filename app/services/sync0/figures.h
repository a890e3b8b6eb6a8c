/* SPDX-License-Identifier: MIT */
/* The figures of one line in one window. Context: any, but it takes a while: it sorts. */
#ifndef SYNC0_FIGURES_H
#define SYNC0_FIGURES_H

#include <stdint.h>

#include "base/sync0.h"
#include "sync0/judge.h"
#include "sync0/window.h"

struct figures_spec {
	int64_t period_ns;
	int64_t origin_dc_ns; /* DC time of cycle 0 */
	int64_t shift_ns;     /* asked of this line, and of the first */
	int64_t first_shift_ns;
};

/* Room to compute in, made once: a window's cycles each. */
struct figures_room {
	uint32_t *x;
	int64_t *y;
	int64_t *scratch;
};

int figures_room_create(uint32_t cycles, struct figures_room *ret_room);
void figures_room_destroy(struct figures_room *room);

/**
 * Fill counts and figures of @ret from line @number of @w. Nothing is judged yet.
 */
void figures_compute(const struct window *w, size_t number, const struct figures_spec *spec,
		     const struct judge_noise *noise, const struct figures_room *room,
		     struct sync0_result *ret);

#endif
