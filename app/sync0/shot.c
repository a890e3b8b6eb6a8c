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

static void remove_at(int64_t *v, int *count, int place)
{
	(*count)--;
	memmove(v + place, v + place + 1, (size_t)(*count - place) * sizeof(v[0]));
}

static void append(int64_t *v, int *count, int limit, int64_t value)
{
	if (*count == limit) {
		remove_at(v, count, 0);
	}
	v[(*count)++] = value;
}

void shot_command(struct shot_line *sl, int64_t due_dc_ns)
{
	append(sl->due_dc_ns, &sl->waiting, SHOT_WAITING, due_dc_ns);
}

void shot_edge(struct shot_line *sl, int64_t mono_ns)
{
	append(sl->edge_mono_ns, &sl->edges, SHOT_EDGES, mono_ns);
}

static int nearest(const struct shot_line *sl, int64_t mono_ns)
{
	int best = -1;

	for (int i = 0; i < sl->edges; i++) {
		int64_t off_ns = llabs(sl->edge_mono_ns[i] - mono_ns);

		if (off_ns <= NEAR_NS &&
		    (best < 0 || off_ns < llabs(sl->edge_mono_ns[best] - mono_ns))) {
			best = i;
		}
	}
	return best;
}

static struct shot_verdict close_shot(struct shot_line *sl, int number, int64_t due_mono_ns)
{
	struct shot_verdict v = { .news = SHOT_LOST,
				  .due_dc_ns = sl->due_dc_ns[number],
				  .mono_ns = due_mono_ns };
	int edge = nearest(sl, due_mono_ns);

	if (edge >= 0) {
		v.news = SHOT_CAME;
		v.mono_ns = sl->edge_mono_ns[edge];
		v.late_ns = v.mono_ns - due_mono_ns;
		remove_at(sl->edge_mono_ns, &sl->edges, edge);
	}
	remove_at(sl->due_dc_ns, &sl->waiting, number);
	return v;
}

struct shot_verdict shot_next(struct shot_line *sl, const struct grid *grid, int64_t until_ns)
{
	struct shot_verdict none = { .news = SHOT_NONE };

	for (int i = 0; i < sl->waiting; i++) {
		int64_t due_ns = grid_mono_ns(grid, sl->due_dc_ns[i]);

		if (due_ns + NEAR_NS < until_ns) {
			return close_shot(sl, i, due_ns);
		}
	}
	if (sl->edges > 0 && sl->edge_mono_ns[0] + EXTRA_AFTER_NS < until_ns) {
		struct shot_verdict v = { .news = SHOT_EXTRA, .mono_ns = sl->edge_mono_ns[0] };

		remove_at(sl->edge_mono_ns, &sl->edges, 0);
		return v;
	}
	return none;
}
