/* SPDX-License-Identifier: MIT */
#include "sync0/checker.h"

#include <errno.h>
#include <stdlib.h>

#include "base/clock.h"
#include "sync0/checker_internal.h"

enum {
	GRACE_PULSES = 64, /* of the slowest line: a window stays open so long, for held edges and
			    * late samples */
	MASTER_BEHIND = 16,
	WINDOW_PULSES_MIN = 16,
	WINDOW_PULSES = 100, /* as config_check() has it for the period of the configuration */
	LOST_PULSES_MIN = 3,
	WINDOWS_AT_ONCE = 16,
	FAR_WINDOWS = 4, /* behind the open ones */
};

#define MASTER_GONE_NS NS_PER_S     /* do not wait longer for its samples */
#define BUNCH_NS (5 * NS_PER_S / 2) /* of one line, before others and cycles are given */
#define FINISH_NS (100 * NS_PER_MS) /* before its newest cycle: all edges have come */

/* So many that a bunch does not close one before the others' edges are in it. */
static int open_windows(const struct checker_spec *spec)
{
	int64_t n = 2 + BUNCH_NS / spec->window_ns;

	return n < OPEN_WINDOWS ? (int)n : OPEN_WINDOWS;
}

static int64_t cycle_ns_of(const struct checker_spec *spec, size_t line)
{
	return spec->line[line].cycle_ns > 0 ? spec->line[line].cycle_ns : spec->period_ns;
}

int checker_fit_window(struct checker_spec *spec)
{
	int64_t least_ns = WINDOW_PULSES * spec->period_ns;

	for (size_t i = 0; i < spec->line_count; i++) {
		int64_t line_ns = WINDOW_PULSES * cycle_ns_of(spec, i);

		least_ns = line_ns > least_ns ? line_ns : least_ns;
	}
	if (spec->window_ns >= least_ns) {
		return 0;
	}
	spec->window_ns = least_ns;
	return 1;
}

static int is_valid(const struct checker_spec *spec)
{
	if (spec->line_count == 0 || spec->line_count > LIMIT_SYNC0_LINES || spec->period_ns <= 0 ||
	    spec->window_ns / spec->period_ns < WINDOW_PULSES_MIN) {
		return 0;
	}
	for (size_t i = 0; i < spec->line_count; i++) {
		int64_t pulses = spec->window_ns / cycle_ns_of(spec, i);

		if (pulses < WINDOW_PULSES_MIN || pulses > CHECKER_PULSES_MAX) {
			return 0;
		}
	}
	return 1;
}

/* Everything that depends on how many pulses of each line a window holds. */
static int create_windows(struct checker *ck)
{
	uint32_t room[LIMIT_SYNC0_LINES];
	uint32_t most = ck->window_cycles;
	int r = 0;

	for (size_t i = 0; i < ck->spec.line_count; i++) {
		int64_t cycle_ns = cycle_ns_of(&ck->spec, i);

		room[i] = (uint32_t)(ck->spec.window_ns / cycle_ns) + 1;
		most = room[i] > most ? room[i] : most;
	}
	for (int i = 0; r == 0 && i < ck->open_windows; i++) {
		r = window_create(ck->window_cycles, ck->spec.line_count, room, &ck->window[i]);
	}
	return r < 0 ? r : measure_scratch_create(most, &ck->scratch);
}

static void create_rows(struct checker *ck)
{
	ck->slow_cycles = 1;
	for (size_t i = 0; i < ck->spec.line_count; i++) {
		int64_t cycles = cycle_ns_of(&ck->spec, i) / ck->spec.period_ns;

		ck->line[i].row.grid = ck->grid;
		ck->line[i].row.period_ns = cycle_ns_of(&ck->spec, i);
		ck->slow_cycles = cycles > ck->slow_cycles ? cycles : ck->slow_cycles;
	}
}

int checker_create(const struct checker_spec *spec, struct checker **ret_checker)
{
	struct checker *ck;
	int r;

	if (!is_valid(spec)) {
		return -EINVAL;
	}
	ck = calloc(1, sizeof(*ck));
	if (ck == NULL) {
		return -ENOMEM;
	}
	ck->spec = *spec;
	ck->window_cycles = (uint32_t)(spec->window_ns / spec->period_ns);
	ck->open_windows = open_windows(spec);
	ck->grid = grid_create(spec->period_ns);
	create_rows(ck);
	r = ck->grid == NULL ? -ENOMEM : create_windows(ck);
	if (r < 0) {
		checker_destroy(ck);
		return r;
	}
	*ret_checker = ck;
	return 0;
}

void checker_destroy(struct checker *ck)
{
	if (ck == NULL) {
		return;
	}
	for (int i = 0; i < OPEN_WINDOWS; i++) {
		window_destroy(ck->window[i]);
	}
	measure_scratch_destroy(&ck->scratch);
	grid_destroy(ck->grid);
	free(ck);
}

void checker_emit(struct checker *ck, const struct event *ev)
{
	if (ck->spec.event != NULL) {
		ck->spec.event(ck->spec.ctx, ev);
	}
}

struct event checker_event(const struct checker *ck, size_t line, enum event_id id, int64_t cycle)
{
	int64_t mono_ns = grid_mono_ns(ck->grid, grid_due_dc_ns(ck->grid, cycle));

	return (struct event){
		.mono_ns = mono_ns,
		.tai_ns = mono_ns + ck->spec.mono_to_tai_ns,
		.cycle = (uint64_t)cycle,
		.value = cycle,
		.id = (uint16_t)id,
		.slave_pos = ck->spec.line[line].slave_pos,
		.line = (uint32_t)line + 1,
	};
}

/* --- pulses --- */

static int64_t div_floor(int64_t a, int64_t m)
{
	return (a - mod_floor(a, m)) / m;
}

int64_t checker_cycle_of(const struct checker *ck, size_t line, int64_t pulse)
{
	const struct line *ln = &ck->line[line];

	return div_floor(ln->base_ns + pulse * ln->row.period_ns, ck->spec.period_ns);
}

int64_t checker_pulse_from(const struct checker *ck, size_t line, int64_t cycle)
{
	const struct line *ln = &ck->line[line];

	return -div_floor(ln->base_ns - cycle * ck->spec.period_ns, ln->row.period_ns);
}

static void place_pulses(const struct checker *ck, struct window *w)
{
	for (size_t i = 0; i < w->line_count; i++) {
		struct window_line *wl = &w->line[i];

		wl->first = checker_pulse_from(ck, i, w->first_cycle);
		wl->pulses = (uint32_t)(checker_pulse_from(ck, i, w->first_cycle + w->cycles) -
					wl->first);
	}
}

/* The master starts SYNC0 at multiples of the slave's own cycle in DC time. */
void checker_set_origin(struct checker *ck, int64_t origin_dc_ns)
{
	int64_t grid_dc_ns = origin_dc_ns - mod_floor(origin_dc_ns, ck->spec.period_ns);

	ck->has_origin = 1;
	ck->origin_dc_ns = origin_dc_ns;
	grid_set_origin(ck->grid, origin_dc_ns);
	for (size_t i = 0; i < ck->spec.line_count; i++) {
		struct line *ln = &ck->line[i];

		ln->base_ns = mod_floor(-grid_dc_ns, ln->row.period_ns);
		ln->row.origin_dc_ns = origin_dc_ns + ln->base_ns + ck->spec.line[i].shift_ns;
	}
	for (int i = 0; ck->has_base && i < ck->open_windows; i++) {
		place_pulses(ck, ck->window[i]);
	}
}

/* --- windows --- */

void checker_open_window(const struct checker *ck, struct window *w, int64_t first_cycle)
{
	window_clear(w, first_cycle);
	place_pulses(ck, w);
}

void checker_begin_at(struct checker *ck, int64_t cycle)
{
	ck->has_base = 1;
	ck->base = cycle;
	ck->window_number = 0;
	for (int i = 0; i < ck->open_windows; i++) {
		checker_open_window(ck, ck->window[i], cycle + (int64_t)i * ck->window_cycles);
	}
}

struct window *checker_window(struct checker *ck, int64_t cycle)
{
	int64_t number;

	if (!ck->has_base || cycle < checker_oldest(ck)->first_cycle) {
		return NULL;
	}
	number = (cycle - ck->base) / ck->window_cycles;
	/* Too far ahead to judge the cycles in between: only the newest count. */
	if (number - ck->window_number > ck->open_windows + FAR_WINDOWS) {
		checker_close_window(ck);
		checker_close_window(ck);
		checker_begin_at(ck, cycle);
		number = 0;
	}
	while (number >= ck->window_number + ck->open_windows) {
		checker_close_window(ck);
	}
	return ck->window[number % ck->open_windows];
}

/* Discard what the open windows have counted. */
static void disturb(struct checker *ck, int64_t cycle, int64_t step_ns)
{
	for (size_t i = 0; i < ck->spec.line_count; i++) {
		tracker_reset(&ck->line[i].track);
		ck->line[i].has_last = 0;
		ck->line[i].last_pulse = checker_pulse_from(ck, i, cycle);
	}
	for (int i = 0; ck->has_base && i < ck->open_windows; i++) {
		struct window *w = ck->window[i];

		if (w->first_cycle <= cycle + GRACE_PULSES * ck->slow_cycles) {
			w->clock_step_ns = step_ns;
		}
	}
}

void checker_clock_stepped(struct checker *ck, int64_t cycle, int64_t step_ns)
{
	struct event ev = checker_event(ck, 0, EVENT_SYNC0_CLOCK_STEP, cycle);

	ev.slave_pos = EVENT_NO_SLAVE;
	ev.line = 0;
	ev.arg[0] = alarm_clamp((double)step_ns);
	checker_emit(ck, &ev);
	disturb(ck, cycle, step_ns);
}

static void pair(struct checker *ck, const struct checker_cycle *cy)
{
	int64_t step_ns;

	if (grid_pair(ck->grid, cy->frame_dc_ns, cy->frame_mono_ns, cy->frame_latency_ns,
		      &step_ns) == GRID_STEPPED) {
		checker_clock_stepped(ck, cy->cycle, step_ns);
	}
}

/* --- the master --- */

static void have_base(struct checker *ck, const struct checker_cycle *cy)
{
	int64_t first;

	if (ck->has_base || !cy->is_judged || !grid_is_ready(ck->grid)) {
		return;
	}
	first = grid_cycle(ck->grid, ck->spec.since_ns) + 2;
	checker_begin_at(ck, first > cy->cycle + 1 ? first : cy->cycle + 1);
}

static void have_origin(struct checker *ck, const struct checker_cycle *cy)
{
	int64_t origin_dc_ns = cy->due_dc_ns - cy->cycle * ck->spec.period_ns;

	/* The master counts its cycles anew, and tells so itself; a clock that has stepped as well
	 * is found by its frames. */
	if (ck->has_origin && origin_dc_ns != ck->origin_dc_ns && grid_is_ready(ck->grid)) {
		disturb(ck, cy->cycle, ck->origin_dc_ns - origin_dc_ns);
	}
	if (!ck->has_origin || origin_dc_ns != ck->origin_dc_ns) {
		checker_set_origin(ck, origin_dc_ns);
	}
}

void checker_cycle(struct checker *ck, const struct checker_cycle *cy)
{
	struct window *w;

	have_origin(ck, cy);
	if (cy->frame_dc_ns != 0) {
		pair(ck, cy);
	}
	have_base(ck, cy);
	ck->newest_cycle = cy->cycle;
	w = checker_window(ck, cy->cycle);
	if (w == NULL) {
		return;
	}
	if (cy->dc_diff_ns > w->dc_diff_ns) {
		w->dc_diff_ns = cy->dc_diff_ns;
	}
	if (cy->frame_dc_ns != 0) {
		int64_t i = cy->cycle - w->first_cycle;

		w->has_frame[i] = 1;
		w->frame_dc_ns[i] = cy->frame_dc_ns;
		w->frame_mono_ns[i] = cy->frame_mono_ns;
		w->frame_latency_ns[i] = cy->frame_latency_ns;
	}
}

/* --- time --- */

/* @mono_ns: all edges before it were given. */
static void look_for_lost(struct checker *ck, size_t number, int64_t mono_ns)
{
	struct line *ln = &ck->line[number];
	int64_t limit = ck->spec.lost_ns / ln->row.period_ns;
	int64_t first = checker_pulse_from(ck, number, ck->base);
	int64_t last = ln->last_pulse >= first ? ln->last_pulse : first - 1;
	int64_t late_ns;
	int64_t pulse = grid_row_pulse(&ln->row, mono_ns, 0, &late_ns) - 1;
	struct event ev;

	limit = limit > LOST_PULSES_MIN ? limit : LOST_PULSES_MIN;
	if (ln->is_lost) {
		if (ln->back_count > 0 && pulse - last > limit) {
			ln->back_count = 0; /* a few came, and none again */
		}
		return;
	}
	if (pulse - last <= limit) {
		return;
	}
	ln->is_lost = 1;
	ln->back_count = 0;
	ln->lost_from = last + 1;
	ln->lost_to = INT64_MAX;
	ck->alarms++;
	ev = checker_event(ck, number, EVENT_SYNC0_LOST, checker_cycle_of(ck, number, last + 1));
	ev.arg[0] = alarm_clamp((double)(pulse - last));
	checker_emit(ck, &ev);
}

static int is_full(const struct checker *ck, int64_t mono_ns)
{
	int64_t end = checker_oldest(ck)->first_cycle + (int64_t)ck->window_cycles;
	int64_t end_ns = grid_mono_ns(
		ck->grid, grid_due_dc_ns(ck->grid, end + GRACE_PULSES * ck->slow_cycles));

	return mono_ns > end_ns + MASTER_GONE_NS ||
	       (mono_ns > end_ns && ck->newest_cycle >= end + MASTER_BEHIND);
}

void checker_advance(struct checker *ck, int64_t mono_ns)
{
	int64_t cycle;

	if (!grid_is_ready(ck->grid) || !ck->has_origin) {
		return;
	}
	for (size_t i = 0; i < ck->spec.line_count; i++) {
		if (ck->spec.line[i].mode == CHECKER_ONESHOT) {
			checker_look_at_shots(ck, i, mono_ns);
		}
	}
	if (!ck->has_base) {
		return;
	}
	for (size_t i = 0; i < ck->spec.line_count; i++) {
		if (ck->spec.line[i].mode == CHECKER_PERIODIC) {
			look_for_lost(ck, i, mono_ns);
		}
	}
	cycle = grid_cycle(ck->grid, mono_ns) - 1;
	/* Nobody listened for so long, or the clock says so: nothing is known of what lies between.
	 */
	if (cycle - checker_oldest(ck)->first_cycle >
	    WINDOWS_AT_ONCE * (int64_t)ck->window_cycles) {
		checker_close_window(ck);
		checker_begin_at(ck, cycle + 1);
	}
	for (int n = 0; n < WINDOWS_AT_ONCE && is_full(ck, mono_ns); n++) {
		checker_close_window(ck);
	}
}

/* By how much the last pulse of a cycle comes after its end, at most. */
static int64_t latest_shift_ns(const struct checker *ck)
{
	int64_t latest_ns = 0;

	for (size_t i = 0; i < ck->spec.line_count; i++) {
		if (ck->spec.line[i].mode == CHECKER_PERIODIC &&
		    ck->spec.line[i].shift_ns > latest_ns) {
			latest_ns = ck->spec.line[i].shift_ns;
		}
	}
	return latest_ns;
}

/* Nothing of the oldest window is still on its way. */
static int is_whole(const struct checker *ck)
{
	int64_t end = checker_oldest(ck)->first_cycle + (int64_t)ck->window_cycles;
	int64_t way_ns = ck->spec.source == SYNC0_RECORDED ? 0 : FINISH_NS;

	return ck->newest_cycle >= end + (way_ns + latest_shift_ns(ck)) / ck->spec.period_ns;
}

void checker_finish(struct checker *ck)
{
	struct tracker_out out;
	int64_t newest_ns;

	if (!grid_is_ready(ck->grid) || !ck->has_base) {
		return;
	}
	newest_ns = grid_mono_ns(ck->grid, grid_due_dc_ns(ck->grid, ck->newest_cycle));
	for (size_t i = 0; i < ck->spec.line_count; i++) {
		if (ck->spec.line[i].mode == CHECKER_ONESHOT) {
			checker_look_at_shots(ck, i, newest_ns - FINISH_NS);
			continue;
		}
		tracker_finish(&ck->line[i].track, &ck->line[i].row, &out);
		checker_take(ck, i, &out);
	}
	for (int n = 0; n < ck->open_windows && is_whole(ck); n++) {
		checker_close_window(ck);
	}
}

int checker_is_lost(const struct checker *ck, size_t line)
{
	return ck->line[line].is_lost;
}

uint64_t checker_windows(const struct checker *ck)
{
	return ck->windows;
}

uint64_t checker_alarms(const struct checker *ck)
{
	return ck->alarms;
}
