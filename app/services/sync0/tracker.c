/* SPDX-License-Identifier: MIT */
#include "sync0/tracker.h"

#include <math.h>

#include "base/clock.h"
#include "sync0/statistics.h"

enum {
	ASTRAY_SHARE = 4, /* of the period, either way: farther off is not the cycle's edge */
	ALIKE_SHARE = 8,  /* held edges within this are a phase */
	STEP_SHARE = 50,  /* a phase that is off by this for TRACKER_HELD edges has changed */
	FOLLOW_SHARE = 64,
};

void tracker_reset(struct tracker *track)
{
	*track = (struct tracker){ .is_locked = 0 };
}

static void emit(struct tracker_out *out, enum tracker_kind kind, int64_t pulse, int64_t mono_ns)
{
	out->item[out->count++] =
		(struct tracker_item){ .kind = kind, .pulse = pulse, .mono_ns = mono_ns };
}

static void emit_extra(const struct tracker *track, const struct grid_row *row,
		       const struct edge *edge, struct tracker_out *out)
{
	int64_t late_ns;

	emit(out, TRACKER_EXTRA,
	     grid_row_pulse(row, edge->mono_ns, (int64_t)track->phase_ns, &late_ns), edge->mono_ns);
}

static void held_are_extra(struct tracker *track, const struct grid_row *row,
			   struct tracker_out *out)
{
	for (int i = 0; i < track->held_count; i++) {
		emit_extra(track, row, &track->held[i], out);
	}
	track->held_count = 0;
}

static void drop_oldest(struct tracker *track, const struct grid_row *row, struct tracker_out *out)
{
	emit_extra(track, row, &track->held[0], out);
	track->held_count--;
	for (int i = 0; i < track->held_count; i++) {
		track->held[i] = track->held[i + 1];
		track->held_late_ns[i] = track->held_late_ns[i + 1];
	}
}

/* Are the held edges a period apart, at one phase? Then that place is *ret_phase_ns. */
static int held_are_alike(const struct tracker *track, int64_t period_ns, int64_t *ret_phase_ns)
{
	int64_t off[TRACKER_HELD];

	for (int i = 0; i < TRACKER_HELD; i++) {
		off[i] = fold_ns(track->held_late_ns[i] - track->held_late_ns[0], period_ns);
		if (i > 0 && track->held[i].mono_ns - track->held[i - 1].mono_ns < period_ns / 2) {
			return 0;
		}
	}
	statistics_sort(off, TRACKER_HELD);
	*ret_phase_ns = track->held_late_ns[0] + off[TRACKER_HELD / 2];
	return off[TRACKER_HELD - 1] - off[0] < period_ns / ALIKE_SHARE;
}

static void take(struct tracker *track, int64_t pulse, int64_t mono_ns, struct tracker_out *out)
{
	if (track->has_last && pulse <= track->last_pulse) {
		emit(out, TRACKER_EXTRA, pulse, mono_ns);
		return;
	}
	emit(out, TRACKER_PULSE, pulse, mono_ns);
	track->has_last = 1;
	track->last_pulse = pulse;
	track->last_mono_ns = mono_ns;
}

static void lock_to(struct tracker *track, const struct grid_row *row, int64_t phase_ns,
		    struct tracker_out *out)
{
	int64_t period_ns = row->period_ns;

	phase_ns = fold_ns(phase_ns, period_ns);
	if (track->is_locked) {
		out->step_ns = fold_ns(phase_ns - (int64_t)track->phase_ns, period_ns);
	}
	track->is_locked = 1;
	track->phase_ns = (double)phase_ns;
	track->run_count = 0;
	for (int i = 0; i < track->held_count; i++) {
		int64_t late_ns;

		take(track, grid_row_pulse(row, track->held[i].mono_ns, phase_ns, &late_ns),
		     track->held[i].mono_ns, out);
	}
	out->step_pulse = out->item[out->count - track->held_count].pulse;
	track->held_count = 0;
}

static void hold(struct tracker *track, const struct grid_row *row, const struct edge *edge,
		 int64_t late_ns, struct tracker_out *out)
{
	int64_t phase_ns;

	track->held[track->held_count] = *edge;
	track->held_late_ns[track->held_count++] = late_ns;
	if (track->held_count < TRACKER_HELD) {
		return;
	}
	if (held_are_alike(track, row->period_ns, &phase_ns)) {
		lock_to(track, row, phase_ns, out);
	} else {
		drop_oldest(track, row, out);
	}
}

/* Is the run one step? All of it lies together, and one interval before it was as much off. */
static int run_is_step(const struct tracker *track, double *ret_middle_ns)
{
	int64_t off[TRACKER_HELD];
	int64_t median;
	double middle;

	for (int i = 0; i < TRACKER_HELD; i++) {
		off[i] = (int64_t)track->run_off_ns[i];
	}
	statistics_sort(off, TRACKER_HELD);
	median = off[TRACKER_HELD / 2];
	middle = (double)median;
	*ret_middle_ns = middle;
	return (double)off[TRACKER_HELD - 1] - (double)off[0] < fabs(middle) / 2 &&
	       fabs(track->run_jump_ns - middle) < fabs(middle) / 2;
}

/* Follow the phase: slowly, or at once when TRACKER_HELD edges in a row show another one. */
static void follow(struct tracker *track, double off_ns, double jump_ns, int64_t period_ns,
		   struct tracker_out *out)
{
	double middle_ns;

	track->phase_ns += off_ns / FOLLOW_SHARE;
	if (fabs(off_ns) < (double)period_ns / STEP_SHARE ||
	    (track->run_count > 0 && (off_ns < 0) != (track->run_off_ns[0] < 0))) {
		track->run_count = 0;
		return;
	}
	if (track->run_count == 0) {
		track->run_jump_ns = jump_ns;
	}
	track->run_off_ns[track->run_count++] = off_ns;
	if (track->run_count < TRACKER_HELD) {
		return;
	}
	if (run_is_step(track, &middle_ns)) {
		out->step_ns = (int64_t)track->run_jump_ns;
		out->step_pulse = track->last_pulse - TRACKER_HELD + 1;
	}
	track->phase_ns += middle_ns;
	track->run_count = 0;
}

/* A phase that has wandered past half a period belongs to the next pulse. */
static void keep_near(struct tracker *track, int64_t period_ns)
{
	double limit_ns = (double)period_ns * 5 / 8;

	if (track->phase_ns > limit_ns) {
		track->phase_ns -= (double)period_ns;
	} else if (track->phase_ns < -limit_ns) {
		track->phase_ns += (double)period_ns;
	}
}

void tracker_edge(struct tracker *track, const struct grid_row *row, const struct edge *edge,
		  struct tracker_out *ret_out)
{
	int64_t period_ns = row->period_ns;
	int64_t late_ns;
	int64_t pulse;
	double off_ns;
	double jump_ns;

	keep_near(track, period_ns);
	pulse = grid_row_pulse(row, edge->mono_ns, (int64_t)track->phase_ns, &late_ns);
	off_ns = (double)late_ns - track->phase_ns;
	ret_out->count = 0;
	ret_out->step_ns = 0;
	if (!track->is_locked || fabs(off_ns) > (double)period_ns / ASTRAY_SHARE) {
		hold(track, row, edge, late_ns, ret_out);
		return;
	}
	held_are_extra(track, row, ret_out);
	jump_ns = track->has_last ? (double)(edge->mono_ns - track->last_mono_ns -
					     (pulse - track->last_pulse) * period_ns)
				  : 0;
	if (track->has_last && pulse <= track->last_pulse) {
		emit(ret_out, TRACKER_EXTRA, pulse, edge->mono_ns);
		return;
	}
	take(track, pulse, edge->mono_ns, ret_out);
	follow(track, off_ns, jump_ns, period_ns, ret_out);
}

void tracker_finish(struct tracker *track, const struct grid_row *row, struct tracker_out *ret_out)
{
	ret_out->count = 0;
	ret_out->step_ns = 0;
	held_are_extra(track, row, ret_out);
}
