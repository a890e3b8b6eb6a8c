/* SPDX-License-Identifier: MIT */
/* Results of a window when it is complete, and of shots when they are due. */
#include <stdlib.h>

#include "sync0/checker_internal.h"

enum { MISSING_REPORTED = 16, ALIKE_SHARE = 16 };

static void emit_from_window(void *ctx, const struct event *ev)
{
	checker_emit(ctx, ev);
}

/* A run of missing edges that is reported as "lost" is not reported again. */
static int is_told(const struct line *ln, int64_t first, int64_t end)
{
	return first < ln->lost_to && end > ln->lost_from && ln->lost_to > ln->lost_from;
}

static void report_missing(struct checker *ck, const struct window *w, size_t number)
{
	const struct window_line *wl = &w->line[number];
	int reported = 0;

	for (uint32_t i = 0; i < wl->pulses && reported < MISSING_REPORTED; i++) {
		uint32_t end = i;
		struct event ev;

		while (end < wl->pulses && wl->mark[end] == WINDOW_UNSEEN) {
			end++;
		}
		if (end == i) {
			continue;
		}
		if (!is_told(&ck->line[number], wl->first + i, wl->first + end)) {
			ev = checker_event(ck, number, EVENT_SYNC0_MISSING,
					   checker_cycle_of(ck, number, wl->first + i));
			ev.arg[0] = (int32_t)(end - i);
			checker_emit(ck, &ev);
			reported++;
		}
		i = end;
	}
}

static void report_counts(struct checker *ck, const struct window *w, size_t number)
{
	const struct window_line *wl = &w->line[number];
	struct event ev;

	report_missing(ck, w, number);
	if (wl->extra > 0) {
		ev = checker_event(ck, number, EVENT_SYNC0_EXTRA,
				   checker_cycle_of(ck, number, wl->first_extra));
		ev.arg[0] = alarm_clamp((double)wl->extra);
		checker_emit(ck, &ev);
	}
	if (wl->step_ns != 0) {
		ev = checker_event(ck, number, EVENT_SYNC0_PHASE_STEP,
				   checker_cycle_of(ck, number, wl->step_pulse));
		ev.arg[0] = alarm_clamp((double)wl->step_ns);
		checker_emit(ck, &ev);
	}
}

static void report_overflow(struct checker *ck, const struct window *w, size_t number)
{
	struct event ev = checker_event(ck, number, EVENT_SYNC0_OVERFLOW, w->first_cycle);

	if (w->line[number].overflow > 0) {
		ev.arg[0] = alarm_clamp((double)w->line[number].overflow);
		checker_emit(ck, &ev);
	}
}

/* By how much all lines stepped alike; 0: they did not. */
static int64_t common_step(const struct checker *ck, const struct window *w, int64_t *ret_cycle)
{
	int64_t step_ns = 0;
	int lines = 0;

	for (size_t i = 0; i < w->line_count; i++) {
		const struct window_line *wl = &w->line[i];

		if (ck->spec.line[i].mode != CHECKER_PERIODIC) {
			continue;
		}
		if (wl->step_ns == 0 || (lines > 0 && llabs(wl->step_ns - step_ns) >
							      ck->spec.period_ns / ALIKE_SHARE)) {
			return 0;
		}
		step_ns = wl->step_ns;
		*ret_cycle = checker_cycle_of(ck, i, wl->step_pulse);
		lines++;
	}
	return lines > 1 ? step_ns : 0;
}

/* All lines stepped alike: it was the clock that they are timed with. */
static void find_common_step(struct checker *ck, struct window *w)
{
	int64_t cycle = 0;
	int64_t step_ns = w->clock_step_ns == 0 ? common_step(ck, w, &cycle) : 0;
	struct event ev;

	if (step_ns == 0) {
		return;
	}
	w->clock_step_ns = step_ns;
	ev = checker_event(ck, 0, EVENT_SYNC0_CLOCK_STEP, cycle);
	ev.slave_pos = EVENT_NO_SLAVE;
	ev.line = 0;
	ev.arg[0] = alarm_clamp((double)step_ns);
	checker_emit(ck, &ev);
}

static struct sync0_result begin_result(const struct checker *ck, size_t number, int64_t mono_ns)
{
	return (struct sync0_result){
		.mono_ns = mono_ns,
		.tai_ns = mono_ns + ck->spec.mono_to_tai_ns,
		.session = ck->spec.session,
		.slave_pos = ck->spec.line[number].slave_pos,
		.line = (uint16_t)number,
		.source = (uint8_t)ck->spec.source,
		.dc_diff_ns = -1,
	};
}

static void close_line(struct checker *ck, const struct window *w, size_t number)
{
	int64_t end_dc_ns = grid_due_dc_ns(ck->grid, w->first_cycle + (int64_t)w->cycles);
	struct sync0_result r = begin_result(ck, number, grid_mono_ns(ck->grid, end_dc_ns));
	const struct measure_spec spec = {
		.period_ns = ck->spec.period_ns,
		.origin_dc_ns = ck->origin_dc_ns,
		.row = &ck->line[number].row,
		.first_row = &ck->line[0].row,
		.shift_ns = ck->spec.line[number].shift_ns,
		.first_shift_ns = ck->spec.line[0].shift_ns,
	};

	r.kind = SYNC0_WINDOW;
	measure_window(w, number, &spec, &ck->spec.noise, &ck->scratch, &r);
	judge(&ck->spec.limits, &ck->spec.noise, spec.shift_ns, &r);
	if (!r.is_disturbed) {
		report_counts(ck, w, number);
	}
	report_overflow(ck, w, number);
	ck->alarms += (uint64_t)alarm_window(&ck->line[number].alarm, &r, &ck->spec.limits,
					     emit_from_window, ck);
	if (ck->spec.result != NULL) {
		ck->spec.result(ck->spec.ctx, &r);
	}
}

void checker_close_window(struct checker *ck)
{
	struct window *w = ck->window[ck->window_number % ck->open_windows];

	find_common_step(ck, w);
	for (size_t i = 0; i < ck->spec.line_count; i++) {
		if (ck->spec.line[i].mode == CHECKER_PERIODIC) {
			close_line(ck, w, i);
		}
	}
	ck->windows++;
	ck->window_number++;
	checker_open_window(ck, w, w->first_cycle + (int64_t)ck->open_windows * w->cycles);
}

/* --- shots --- */

/* What is not resolved lies within its bound, so that no reader takes it for a figure. */
static int64_t shot_bound_ns(const struct checker *ck, const struct sync0_result *r)
{
	int64_t bound_ns = r->phase_error_ns + ck->spec.noise.max_ns;
	int64_t late_ns = llabs(r->shot_late_ns);

	return r->is_resolved & SYNC0_HAS_PHASE || late_ns < bound_ns ? bound_ns : late_ns;
}

static void report_shot(struct checker *ck, size_t number, const struct shot_verdict *v)
{
	struct sync0_result r = begin_result(ck, number, v->mono_ns);
	struct event ev;

	r.kind = SYNC0_SHOT;
	r.first_cycle = (uint64_t)grid_cycle(ck->grid, v->mono_ns);
	r.cycles = 1;
	r.has_come = v->outcome == SHOT_CAME;
	r.edges = r.has_come;
	r.missing = 1 - r.edges;
	r.shot_dc_ns = v->due_dc_ns;
	r.shot_late_ns = v->late_ns;
	r.phase_error_ns = grid_uncertainty_ns(ck->grid);
	judge(&ck->spec.limits, &ck->spec.noise, 0, &r);
	ev = alarm_event(&r, r.has_come ? EVENT_SYNC0_SHOT : EVENT_SYNC0_SHOT_LOST);
	ev.value = v->due_dc_ns;
	ev.arg[0] = alarm_clamp((double)v->late_ns);
	ev.arg[1] = alarm_clamp((double)shot_bound_ns(ck, &r));
	checker_emit(ck, &ev);
	ck->alarms += r.has_come ? 0 : 1;
	if (ck->spec.result != NULL) {
		ck->spec.result(ck->spec.ctx, &r);
	}
}

static void report_extra_shot(struct checker *ck, size_t number, int64_t mono_ns)
{
	struct event ev =
		checker_event(ck, number, EVENT_SYNC0_EXTRA, grid_cycle(ck->grid, mono_ns));

	ev.mono_ns = mono_ns;
	ev.arg[0] = 1;
	checker_emit(ck, &ev);
}

void checker_look_at_shots(struct checker *ck, size_t line, int64_t until_ns)
{
	for (;;) {
		struct shot_verdict v = shot_next(&ck->line[line].shot, ck->grid, until_ns);

		switch (v.outcome) {
		case SHOT_NONE:
			return;
		case SHOT_LOST:
			if (v.mono_ns < ck->spec.since_ns) {
				break; /* edges were not received */
			}
			report_shot(ck, line, &v);
			break;
		case SHOT_CAME:
			report_shot(ck, line, &v);
			break;
		case SHOT_EXTRA:
			report_extra_shot(ck, line, v.mono_ns);
			break;
		}
	}
}
