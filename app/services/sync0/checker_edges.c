/* SPDX-License-Identifier: MIT */
/* The way of an edge: its line's track gives it a pulse, the window of the pulse takes it. */
#include "sync0/checker_internal.h"

enum {
	BACK_EDGES = 3,
	FIRST_SELF_CYCLE = 2, /* without a master: lines do not all begin in the same cycle */
};

/* Without a master, the first line's edges are the cycles. */
static void cycle_by_edge(struct checker *ck, const struct edge *edge)
{
	struct edge_cycle self;
	int64_t step_ns;

	if (!edge_grid_take(&ck->self, ck->spec.period_ns, edge, &self)) {
		return;
	}
	if (!ck->has_origin) {
		checker_set_origin(ck, self.dc_ns - self.cycle * ck->spec.period_ns -
					       ck->spec.line[0].shift_ns);
	}
	if (grid_pair(ck->grid, self.dc_ns, edge->mono_ns, 0, &step_ns) == GRID_STEPPED) {
		checker_clock_stepped(ck, self.cycle, step_ns);
	}
	ck->newest_cycle = self.cycle;
	if (!ck->has_base) {
		checker_begin_at(ck, self.cycle + FIRST_SELF_CYCLE);
	}
}

static void report_back(struct checker *ck, size_t number, int64_t pulse)
{
	struct line *ln = &ck->line[number];
	struct event ev;

	if (!ln->is_lost) {
		return;
	}
	if (ln->back_count == 0) {
		ln->lost_to = pulse;
	}
	if (++ln->back_count < BACK_EDGES) {
		return;
	}
	ln->is_lost = 0;
	ev = checker_event(ck, number, EVENT_SYNC0_BACK, checker_cycle_of(ck, number, ln->lost_to));
	ev.arg[0] = alarm_clamp((double)(ln->lost_to - ln->lost_from));
	checker_emit(ck, &ev);
}

/* The window of a pulse of the line; NULL if it is not judged. */
static struct window *window_of(struct checker *ck, size_t number, int64_t pulse)
{
	return checker_window(ck, checker_cycle_of(ck, number, pulse));
}

/* What the kernel dropped lies just before the edge that it gave. */
static void mark_overflow(struct checker *ck, size_t number, int64_t pulse)
{
	struct line *ln = &ck->line[number];

	for (int64_t p = pulse - 1; ln->dropped > 0 && ln->has_last && p > ln->last_pulse; p--) {
		struct window *w = window_of(ck, number, p);

		if (w == NULL) {
			break;
		}
		w->line[number].mark[p - w->line[number].first] = WINDOW_OVERFLOWN;
		ln->dropped--;
	}
	ln->dropped = 0;
}

static void take_pulse(struct checker *ck, size_t number, const struct tracker_item *item)
{
	struct line *ln = &ck->line[number];
	struct window *w = window_of(ck, number, item->pulse);
	struct window_line *wl;

	if (w == NULL) {
		return;
	}
	mark_overflow(ck, number, item->pulse);
	wl = &w->line[number];
	wl->mark[item->pulse - wl->first] = WINDOW_SEEN;
	wl->mono_ns[item->pulse - wl->first] = item->mono_ns;
	if (ln->has_last && item->pulse == ln->last_pulse + 1 && ck->spec.deviation != NULL) {
		ck->spec.deviation(ck->spec.ctx, number,
				   item->mono_ns - ln->last_mono_ns - ln->row.period_ns);
	}
	ln->has_last = 1;
	ln->last_pulse = item->pulse;
	ln->last_mono_ns = item->mono_ns;
	report_back(ck, number, item->pulse);
}

static void take_item(struct checker *ck, size_t number, const struct tracker_item *item)
{
	struct window *w;

	if (item->kind == TRACKER_PULSE) {
		take_pulse(ck, number, item);
		return;
	}
	w = window_of(ck, number, item->pulse);
	if (w != NULL) {
		if (w->line[number].extra++ == 0) {
			w->line[number].first_extra = item->pulse;
		}
	}
}

static void note_step(struct checker *ck, size_t number, const struct tracker_out *out)
{
	struct window *w = out->step_ns != 0 ? window_of(ck, number, out->step_pulse) : NULL;

	if (w != NULL) {
		w->line[number].step_ns = out->step_ns;
		w->line[number].step_pulse = out->step_pulse;
	}
}

void checker_take(struct checker *ck, size_t number, const struct tracker_out *out)
{
	for (int i = 0; i < out->count; i++) {
		take_item(ck, number, &out->item[i]);
	}
	note_step(ck, number, out);
}

static void note_seqno(struct checker *ck, const struct edge *edge)
{
	struct line *ln = &ck->line[edge->line];
	uint32_t gap = edge->seqno - ln->last_seqno - 1;
	struct window *w;

	if (edge->seqno != 0 && ln->last_seqno != 0 && gap != 0 && gap < UINT32_MAX / 2) {
		ln->dropped += gap;
		w = checker_window(ck, grid_cycle(ck->grid, edge->mono_ns));
		if (w != NULL) {
			w->line[edge->line].overflow += gap;
		}
	}
	ln->last_seqno = edge->seqno;
}

void checker_edge(struct checker *ck, const struct edge *edge)
{
	struct tracker_out out;

	if (edge->line >= ck->spec.line_count || ck->spec.line[edge->line].mode == CHECKER_OFF) {
		return;
	}
	if (ck->spec.line[edge->line].mode == CHECKER_ONESHOT) {
		shot_edge(&ck->line[edge->line].shot, edge->mono_ns);
		return;
	}
	if (ck->spec.grid == CHECKER_GRID_EDGES && edge->line == 0) {
		cycle_by_edge(ck, edge);
	}
	if (!grid_is_ready(ck->grid) || !ck->has_origin) {
		return;
	}
	note_seqno(ck, edge);
	tracker_edge(&ck->line[edge->line].track, &ck->line[edge->line].row, edge, &out);
	checker_take(ck, edge->line, &out);
}

void checker_shot(struct checker *ck, size_t line, int64_t at_dc_ns, int64_t due_dc_ns)
{
	if (line < ck->spec.line_count && ck->spec.line[line].mode == CHECKER_ONESHOT) {
		shot_command(&ck->line[line].shot, at_dc_ns, due_dc_ns);
	}
}
