/* SPDX-License-Identifier: MIT */
#include "sync0/shot.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

/* An edge farther than this from the commanded time is not its own. */
#define NEAR_NS NS_PER_MS
/* An edge is extra if no shot was commanded for its time after so long: commands come by the ring.
 */
#define EXTRA_AFTER_NS NS_PER_S

static void remove_due(struct shot_line *sl, int place)
{
	sl->waiting--;
	memmove(sl->due + place, sl->due + place + 1,
		(size_t)(sl->waiting - place) * sizeof(sl->due[0]));
}

static void remove_edge(struct shot_line *sl, int place)
{
	sl->edges--;
	memmove(sl->edge_mono_ns + place, sl->edge_mono_ns + place + 1,
		(size_t)(sl->edges - place) * sizeof(sl->edge_mono_ns[0]));
}

void shot_command(struct shot_line *sl, int64_t at_dc_ns, int64_t due_dc_ns)
{
	for (int i = sl->waiting - 1; i >= 0; i--) {
		if (sl->due[i].dc_ns == due_dc_ns) {
			remove_due(sl, i); /* it is armed again */
		} else if (sl->due[i].dc_ns > at_dc_ns) {
			sl->due[i].is_withdrawn = 1;
		}
	}
	if (due_dc_ns <= at_dc_ns) {
		return;
	}
	if (sl->waiting == SHOT_WAITING) {
		remove_due(sl, 0);
	}
	sl->due[sl->waiting++] = (struct shot_due){ .dc_ns = due_dc_ns };
}

void shot_edge(struct shot_line *sl, int64_t mono_ns)
{
	if (sl->edges == SHOT_EDGES) {
		remove_edge(sl, 0);
	}
	sl->edge_mono_ns[sl->edges++] = mono_ns;
}

/* An edge is that of the commanded time that it is nearest to. */
static int is_of(const struct shot_line *sl, const struct grid *grid, int number, int64_t mono_ns)
{
	int64_t off_ns = llabs(mono_ns - grid_mono_ns(grid, sl->due[number].dc_ns));

	for (int i = 0; i < sl->waiting; i++) {
		if (llabs(mono_ns - grid_mono_ns(grid, sl->due[i].dc_ns)) < off_ns) {
			return 0;
		}
	}
	return off_ns <= NEAR_NS;
}

static int find_edge(const struct shot_line *sl, const struct grid *grid, int number)
{
	for (int i = 0; i < sl->edges; i++) {
		if (is_of(sl, grid, number, sl->edge_mono_ns[i])) {
			return i;
		}
	}
	return -1;
}

/* SHOT_NONE: it was withdrawn, and did not come. */
static struct shot_verdict close_shot(struct shot_line *sl, const struct grid *grid, int number)
{
	struct shot_verdict v = { .outcome = sl->due[number].is_withdrawn ? SHOT_NONE : SHOT_LOST,
				  .due_dc_ns = sl->due[number].dc_ns };
	int64_t due_ns = grid_mono_ns(grid, v.due_dc_ns);
	int edge = find_edge(sl, grid, number);

	v.mono_ns = due_ns;
	if (edge >= 0) {
		v.outcome = SHOT_CAME;
		v.mono_ns = sl->edge_mono_ns[edge];
		v.late_ns = v.mono_ns - due_ns;
		remove_edge(sl, edge);
	}
	remove_due(sl, number);
	return v;
}

static struct shot_verdict next_due(struct shot_line *sl, const struct grid *grid, int64_t until_ns)
{
	int i = 0;

	while (i < sl->waiting) {
		struct shot_verdict v;

		if (grid_mono_ns(grid, sl->due[i].dc_ns) + NEAR_NS >= until_ns) {
			i++;
			continue;
		}
		v = close_shot(sl, grid, i);
		if (v.outcome != SHOT_NONE) {
			return v;
		}
	}
	return (struct shot_verdict){ .outcome = SHOT_NONE };
}

struct shot_verdict shot_next(struct shot_line *sl, const struct grid *grid, int64_t until_ns)
{
	struct shot_verdict v = next_due(sl, grid, until_ns);

	if (v.outcome == SHOT_NONE && sl->edges > 0 &&
	    sl->edge_mono_ns[0] + EXTRA_AFTER_NS < until_ns) {
		v = (struct shot_verdict){ .outcome = SHOT_EXTRA, .mono_ns = sl->edge_mono_ns[0] };
		remove_edge(sl, 0);
	}
	return v;
}
