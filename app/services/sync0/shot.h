/* SPDX-License-Identifier: MIT */
/*
 * One-shot mode: a pulse for each commanded DC time, and none besides. Context: any.
 */
#ifndef SYNC0_SHOT_H
#define SYNC0_SHOT_H

#include <stdint.h>

#include "sync0/grid.h"

enum { SHOT_WAITING = 16, SHOT_EDGES = 64 };

struct shot_due {
	int64_t dc_ns;
	int is_withdrawn; /* another time was set before: it may come, it need not */
};

struct shot_line {
	struct shot_due due[SHOT_WAITING]; /* commanded, oldest first */
	int waiting;
	int64_t edge_mono_ns[SHOT_EDGES]; /* belonging to none yet, oldest first */
	int edges;
};

enum shot_outcome { SHOT_NONE, SHOT_CAME, SHOT_LOST, SHOT_EXTRA };

struct shot_verdict {
	enum shot_outcome outcome;
	int64_t due_dc_ns;
	int64_t mono_ns; /* of the edge; of the due time if none came */
	int64_t late_ns;
};

/**
 * At DC time @at_dc_ns the time of the shot was set to @due_dc_ns; one that has passed, 0 above
 * all, arms none. What was armed and is not due yet is withdrawn; the slave may see that too late.
 */
void shot_command(struct shot_line *sl, int64_t at_dc_ns, int64_t due_dc_ns);
void shot_edge(struct shot_line *sl, int64_t mono_ns);
/**
 * All edges before @until_ns are known: return the next shot that can be judged. Call until
 * SHOT_NONE. The grid must be ready.
 */
struct shot_verdict shot_next(struct shot_line *sl, const struct grid *grid, int64_t until_ns);

#endif
