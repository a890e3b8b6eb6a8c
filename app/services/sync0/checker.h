/* SPDX-License-Identifier: MIT */
/*
 * The check itself: edges and the master's cycles in, results and events out. It reads no clock
 * and no file, so its results for a stream of edges can be tested against the contents of the
 * stream. One checker is one session of the master. Context: any; not RT-safe (it sorts whole
 * windows).
 */
#ifndef SYNC0_CHECKER_H
#define SYNC0_CHECKER_H

#include <stddef.h>
#include <stdint.h>

#include "base/event.h"
#include "base/limits.h"
#include "base/sync0.h"
#include "sync0/edge.h"
#include "sync0/judge.h"

enum checker_grid {
	CHECKER_GRID_MASTER, /* cycles come by checker_cycle() */
	CHECKER_GRID_EDGES,  /* there is no master: the first line's own edges are the cycles */
};

enum checker_mode {
	CHECKER_PERIODIC = 0,
	CHECKER_ONESHOT,
	CHECKER_OFF, /* no edges can be received: no results */
};

struct checker_line {
	uint16_t slave_pos;
	enum checker_mode mode;
	int64_t cycle_ns; /* of its SYNC0: a multiple or a fraction of the period; 0: the period */
	int64_t shift_ns; /* of its SYNC0 against the multiples of that */
};

/* Most pulses of one line in a window. */
enum { CHECKER_PULSES_MAX = 1 << 20 };

struct checker_spec {
	int64_t period_ns;
	int64_t window_ns;
	int64_t lost_ns;  /* without an edge for so long: SYNC0 lost */
	int64_t since_ns; /* edges before this were not received; CLOCK_MONOTONIC */
	enum checker_grid grid;
	enum sync0_source source;
	uint64_t session;
	int64_t mono_to_tai_ns; /* for the results' times */
	size_t line_count;
	struct checker_line line[LIMIT_SYNC0_LINES];
	struct judge_limits limits;
	struct judge_noise noise;
	/* What comes out; any may be NULL. */
	void (*result)(void *ctx, const struct sync0_result *result);
	void (*event)(void *ctx, const struct event *event);
	void (*deviation)(void *ctx, size_t line, int64_t ns); /* of each period from nominal */
	void *ctx;
};

struct checker;

/** Make the window hold 100 pulses of the slowest line at least. 1 if it was shorter. */
int checker_fit_window(struct checker_spec *spec);

/**
 * Everything is allocated here. 0, -ENOMEM or -EINVAL: no line, no period, or a window that holds
 * too few or too many pulses of a line.
 */
int checker_create(const struct checker_spec *spec, struct checker **ret_checker);
void checker_destroy(struct checker *ck);

/* The master's data of one cycle. */
struct checker_cycle {
	int64_t cycle;
	int64_t due_dc_ns;        /* of its SYNC0 */
	int64_t frame_dc_ns;      /* 0: no frame */
	int64_t frame_mono_ns;    /* CLOCK_MONOTONIC when the frame passed the reference clock */
	int64_t frame_latency_ns; /* give or take this */
	int64_t dc_diff_ns;       /* -1: not read */
	int is_judged;            /* the bus was in OP: SYNC0 has to be there from now on */
};

void checker_cycle(struct checker *ck, const struct checker_cycle *cy);
/** At DC time @at_dc_ns the shot of @line was set to @due_dc_ns: see shot_command(). */
void checker_shot(struct checker *ck, size_t line, int64_t at_dc_ns, int64_t due_dc_ns);
/** In order of time for each line. */
void checker_edge(struct checker *ck, const struct edge *edge);
/** All edges before @mono_ns were given: close what is full, find what is lost. */
void checker_advance(struct checker *ck, int64_t mono_ns);
/** No edge follows. A window that is not full is not judged. */
void checker_finish(struct checker *ck);

/** 1 if SYNC0 of @line is lost now. */
int checker_is_lost(const struct checker *ck, size_t line);
/** Windows closed so far. */
uint64_t checker_windows(const struct checker *ck);
/** Alarms raised so far. */
uint64_t checker_alarms(const struct checker *ck);

#endif
