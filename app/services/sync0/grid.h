/* SPDX-License-Identifier: MIT */
/*
 * The grid of cycles on the host's clock: base/timemap.h, fed with CLOCK_MONOTONIC beside DC time,
 * says when a SYNC0 edge is due and which cycle or pulse an instant belongs to. A clock that
 * stepped (the host's or the reference's) restarts the map and is reported. Context: blocking.
 */
#ifndef SYNC0_GRID_H
#define SYNC0_GRID_H

#include <stdint.h>

struct grid;

/** NULL with errno. Free with grid_destroy(). */
struct grid *grid_create(int64_t period_ns);
void grid_destroy(struct grid *grid);

/** The SYNC0 of cycle 0 was at DC time @dc_ns. */
void grid_set_origin(struct grid *grid, int64_t dc_ns);

enum grid_change { GRID_QUIET, GRID_STEPPED };

/**
 * At DC time @dc_ns the host's clock showed @mono_ns, give or take @latency_ns. GRID_STEPPED: so
 * do all of the last few pairs, and the map differs from them; *ret_step_ns is by how much the
 * host's clock is ahead of it now.
 */
enum grid_change grid_pair(struct grid *grid, int64_t dc_ns, int64_t mono_ns, int64_t latency_ns,
			   int64_t *ret_step_ns);

/** 1 as soon as one pair was given. */
int grid_is_ready(const struct grid *grid);

/** CLOCK_MONOTONIC at @dc_ns. The grid must be ready. */
int64_t grid_mono_ns(const struct grid *grid, int64_t dc_ns);
/** What grid_mono_ns() may be off by. */
int64_t grid_uncertainty_ns(const struct grid *grid);

/** DC time at which @cycle begins. */
int64_t grid_due_dc_ns(const struct grid *grid, int64_t cycle);
/** The cycle whose beginning is nearest to @mono_ns. */
int64_t grid_cycle(const struct grid *grid, int64_t mono_ns);

/* The pulses of one line: number p is due at DC time origin_dc_ns + p * period_ns. */
struct grid_row {
	const struct grid *grid;
	int64_t period_ns;
	int64_t origin_dc_ns;
};

/**
 * The pulse whose due time, shifted by @shift_ns, is nearest to @mono_ns; *ret_late_ns is how far
 * @mono_ns is behind the due time itself.
 */
int64_t grid_row_pulse(const struct grid_row *row, int64_t mono_ns, int64_t shift_ns,
		       int64_t *ret_late_ns);

#endif
