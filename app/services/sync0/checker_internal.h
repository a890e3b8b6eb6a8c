/* SPDX-License-Identifier: MIT */
/* Private to the files checker*.c. */
#ifndef SYNC0_CHECKER_INTERNAL_H
#define SYNC0_CHECKER_INTERNAL_H

#include "sync0/alarm.h"
#include "sync0/checker.h"
#include "sync0/edge_grid.h"
#include "sync0/grid.h"
#include "sync0/measure.h"
#include "sync0/shot.h"
#include "sync0/tracker.h"
#include "sync0/window.h"

enum { OPEN_WINDOWS = 32 };

struct line {
	struct grid_row row; /* its pulses */
	int64_t base_ns;     /* from cycle 0 to pulse 0, its shift left out */
	struct tracker track;
	struct alarm_line alarm;
	struct shot_line shot;
	uint32_t last_seqno;
	uint64_t dropped;     /* by the kernel, before the next edge */
	int has_last;         /* a pulse that is judged had its edge */
	int64_t last_pulse;   /* the newest of them */
	int64_t last_mono_ns; /* and its edge */
	int is_lost;
	int64_t lost_from; /* first pulse without an edge, and first with one again */
	int64_t lost_to;
	int back_count;
};

struct checker {
	struct checker_spec spec;
	struct grid *grid;
	struct edge_grid self;
	struct measure_scratch scratch;
	struct window *window[OPEN_WINDOWS]; /* the oldest open one is number % open_windows */
	int open_windows;
	int64_t window_number;
	uint32_t window_cycles;
	int64_t slow_cycles; /* that the slowest SYNC0 takes */
	int has_base;
	int64_t base; /* first cycle that is judged */
	int has_origin;
	int64_t origin_dc_ns;
	int64_t newest_cycle; /* of the master, or of the first line */
	uint64_t windows;
	uint64_t alarms;
	struct line line[LIMIT_SYNC0_LINES];
};

static inline struct window *checker_oldest(const struct checker *ck)
{
	return ck->window[ck->window_number % ck->open_windows];
}

/** Judge from @cycle on. */
void checker_begin_at(struct checker *ck, int64_t cycle);
/** Cycle 0 was at DC time @origin_dc_ns. */
void checker_set_origin(struct checker *ck, int64_t origin_dc_ns);
/** Clear @w, which begins at @first_cycle from now on. */
void checker_open_window(const struct checker *ck, struct window *w, int64_t first_cycle);
/** The host's clock went ahead of DC time by @step_ns in about @cycle. */
void checker_clock_stepped(struct checker *ck, int64_t cycle, int64_t step_ns);
/** Take what has become clear of @line. */
void checker_take(struct checker *ck, size_t number, const struct tracker_out *out);
/** The open window that holds @cycle, closing older ones if it must; NULL if it is not judged. */
struct window *checker_window(struct checker *ck, int64_t cycle);
/** The cycle in which @pulse of the line belongs, its shift left out. */
int64_t checker_cycle_of(const struct checker *ck, size_t line, int64_t pulse);
/** The first pulse of the line in @cycle or after it. */
int64_t checker_pulse_from(const struct checker *ck, size_t line, int64_t cycle);
/** Measure, judge and report the oldest open window, and open the next. */
void checker_close_window(struct checker *ck);
void checker_emit(struct checker *ck, const struct event *ev);
/** An event of @line in @cycle, its time filled in. */
struct event checker_event(const struct checker *ck, size_t line, enum event_id id, int64_t cycle);
/** Report the shots of @line that can be judged. */
void checker_look_at_shots(struct checker *ck, size_t line, int64_t until_ns);

#endif
