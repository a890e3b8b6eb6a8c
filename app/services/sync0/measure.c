/* SPDX-License-Identifier: MIT */
#include "sync0/measure.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>

#include "sync0/statistics.h"

#define PPB 1e9

int measure_scratch_create(uint32_t count, struct measure_scratch *ret_scratch)
{
	struct measure_scratch scratch = {
		.x = calloc(count, sizeof(uint32_t)),
		.y = calloc(count, sizeof(int64_t)),
		.scratch = calloc(count, sizeof(int64_t)),
	};

	if (scratch.x == NULL || scratch.y == NULL || scratch.scratch == NULL) {
		measure_scratch_destroy(&scratch);
		return -ENOMEM;
	}
	*ret_scratch = scratch;
	return 0;
}

void measure_scratch_destroy(struct measure_scratch *scratch)
{
	free(scratch->x);
	free(scratch->y);
	free(scratch->scratch);
	*scratch = (struct measure_scratch){ .x = NULL };
}

/* DC time at which @pulse would be due without the shift, from the start of the window. */
static int64_t offset_ns(const struct window *w, const struct measure_spec *spec, int64_t pulse)
{
	return spec->row->origin_dc_ns - spec->shift_ns + pulse * spec->row->period_ns -
	       spec->origin_dc_ns - w->first_cycle * spec->period_ns;
}

static void count(const struct window *w, const struct window_line *wl,
		  const struct measure_spec *spec, struct sync0_result *ret)
{
	for (uint32_t i = 0; i < wl->pulses; i++) {
		if (wl->mark[i] == WINDOW_SEEN) {
			ret->edges++;
		} else if (wl->mark[i] == WINDOW_UNSEEN) {
			if (ret->missing == 0) {
				ret->first_missing = (uint64_t)(w->first_cycle +
								offset_ns(w, spec, wl->first + i) /
									spec->period_ns);
			}
			ret->missing++;
		}
	}
	ret->cycles = wl->pulses;
	ret->extra = wl->extra;
	ret->overflow = wl->overflow;
}

/* Mean, spread and percentiles of the times between neighbouring pulses' edges. */
static void period(const struct window_line *wl, const struct measure_scratch *scratch,
		   struct sync0_result *ret)
{
	int64_t first = -1;
	int64_t last = -1;
	double squares = 0;
	size_t n = 0;

	for (uint32_t i = 0; i < wl->pulses; i++) {
		if (wl->mark[i] == WINDOW_SEEN) {
			first = first < 0 ? i : first;
			last = i;
		}
	}
	if (last <= first) {
		return;
	}
	ret->period_ns = (double)(wl->mono_ns[last] - wl->mono_ns[first]) / (double)(last - first);
	for (uint32_t i = 1; i < wl->pulses; i++) {
		if (wl->mark[i] == WINDOW_SEEN && wl->mark[i - 1] == WINDOW_SEEN) {
			double off = (double)(wl->mono_ns[i] - wl->mono_ns[i - 1]) - ret->period_ns;

			squares += off * off;
			scratch->y[n++] = llabs(llround(off));
		}
	}
	if (n < 2) {
		return;
	}
	statistics_sort(scratch->y, n);
	ret->period_sd_ns = sqrt(squares / (double)(n - 1));
	ret->jitter_p50_ns = statistics_percentile(scratch->y, n, 500000);
	ret->jitter_p99_ns = statistics_percentile(scratch->y, n, 990000);
	ret->jitter_max_ns = scratch->y[n - 1];
	ret->has |= SYNC0_HAS_PERIOD;
}

static int64_t due_dc_ns(const struct grid_row *row, int64_t pulse)
{
	return row->origin_dc_ns + pulse * row->period_ns;
}

/* The host's clock minus DC time, at every edge. */
static int fit_edges(const struct window_line *wl, const struct grid_row *row, int64_t base_ns,
		     const struct measure_scratch *scratch, struct statistics_fit *ret_fit)
{
	size_t n = 0;

	for (uint32_t i = 0; i < wl->pulses; i++) {
		if (wl->mark[i] == WINDOW_SEEN) {
			scratch->x[n] = i;
			scratch->y[n++] = wl->mono_ns[i] - due_dc_ns(row, wl->first + i) - base_ns;
		}
	}
	return statistics_line(scratch->x, scratch->y, n, scratch->scratch, ret_fit);
}

/* The same at every frame; *ret_latency_ns is what a pair may be off by. */
static int fit_frames(const struct window *w, int64_t base_ns,
		      const struct measure_scratch *scratch, struct statistics_fit *ret_fit,
		      int64_t *ret_latency_ns)
{
	size_t n = 0;
	int r;

	for (uint32_t i = 0; i < w->cycles; i++) {
		if (w->has_frame[i]) {
			scratch->x[n] = i;
			scratch->y[n++] = w->frame_mono_ns[i] - w->frame_dc_ns[i] - base_ns;
		}
	}
	r = statistics_line(scratch->x, scratch->y, n, scratch->scratch, ret_fit);
	if (r < 0) {
		return r;
	}
	n = 0;
	for (uint32_t i = 0; i < w->cycles; i++) {
		if (w->has_frame[i]) {
			scratch->scratch[n++] = w->frame_latency_ns[i];
		}
	}
	*ret_latency_ns = statistics_median(scratch->scratch, n);
	return 0;
}

static int64_t base_of(const struct window *w, const struct window_line *wl,
		       const struct grid_row *row)
{
	for (uint32_t i = 0; i < w->cycles; i++) {
		if (w->has_frame[i]) {
			return w->frame_mono_ns[i] - w->frame_dc_ns[i];
		}
	}
	for (uint32_t i = 0; i < wl->pulses; i++) {
		if (wl->mark[i] == WINDOW_SEEN) {
			return wl->mono_ns[i] - due_dc_ns(row, wl->first + i);
		}
	}
	return 0;
}

static void against_frames(const struct window *w, const struct window_line *wl,
			   const struct statistics_fit *edges, const struct measure_spec *spec,
			   const struct measure_scratch *scratch, struct sync0_result *ret)
{
	double frame_ppb = PPB / (double)spec->period_ns;
	double edge_ppb = PPB / (double)spec->row->period_ns;
	/* The middle of the edges, in cycles of the window. */
	double centre = ((double)(offset_ns(w, spec, wl->first) + spec->shift_ns) +
			 edges->centre * (double)spec->row->period_ns) /
			(double)spec->period_ns;
	struct statistics_fit frames;
	int64_t latency_ns;

	if (fit_frames(w, base_of(w, wl, spec->row), scratch, &frames, &latency_ns) < 0) {
		return;
	}
	ret->has |= SYNC0_HAS_RATE | SYNC0_HAS_PHASE;
	ret->rate_ppb = frames.slope * frame_ppb - edges->slope * edge_ppb;
	/* Wake-ups and round trips change together, not each for itself: a change in mid-window
	 * tilts the line by up to this. */
	ret->rate_error_ppb =
		edges->slope_error * edge_ppb +
		(frames.slope_error + (frames.sigma + (double)latency_ns) / (double)w->cycles) *
			frame_ppb;
	ret->phase_ns =
		llround(edges->offset - frames.offset - frames.slope * (centre - frames.centre)) +
		spec->shift_ns;
	ret->phase_error_ns = llround(edges->offset_error + frames.offset_error) + latency_ns;
}

/* Of the pulses with which a cycle begins. */
static void frame_distance(const struct window *w, const struct window_line *wl,
			   const struct measure_spec *spec, const struct measure_scratch *scratch,
			   struct sync0_result *ret)
{
	size_t n = 0;

	for (uint32_t i = 0; i < wl->pulses; i++) {
		int64_t at_ns = offset_ns(w, spec, wl->first + i);
		int64_t cycle = at_ns / spec->period_ns;

		if (wl->mark[i] == WINDOW_SEEN && at_ns % spec->period_ns == 0 &&
		    w->has_frame[cycle]) {
			scratch->scratch[n++] = w->frame_mono_ns[cycle] - wl->mono_ns[i];
		}
	}
	ret->frame_ns = statistics_median(scratch->scratch, n);
}

/* The edge of the first line's pulse that is due with @pulse of this one, both shifts left out;
 * NULL: there is none in the window. */
static const int64_t *first_edge(const struct window *w, const struct measure_spec *spec,
				 int64_t pulse)
{
	const struct window_line *first = &w->line[0];
	int64_t since_ns = due_dc_ns(spec->row, pulse) - spec->shift_ns -
			   (spec->first_row->origin_dc_ns - spec->first_shift_ns);
	int64_t i = since_ns / spec->first_row->period_ns - first->first;

	return since_ns % spec->first_row->period_ns == 0 && i >= 0 && i < first->pulses &&
			       first->mark[i] == WINDOW_SEEN
		       ? &first->mono_ns[i]
		       : NULL;
}

static void skew(const struct window *w, size_t number, const struct measure_spec *spec,
		 const struct judge_noise *noise, const struct measure_scratch *scratch,
		 struct sync0_result *ret)
{
	const struct window_line *wl = &w->line[number];
	int is_pair = number == 1 && noise->has_pair;
	/* The shifts are times of the DC clock, the edges' are of the host's. */
	double shift_ns =
		(double)(spec->shift_ns - spec->first_shift_ns) * (1 - ret->drift_ppb / PPB);
	int64_t asked_ns = llround(shift_ns) + (is_pair ? noise->bias_ns : 0);
	struct statistics_fit fit;
	size_t n = 0;

	for (uint32_t i = 0; i < wl->pulses; i++) {
		const int64_t *first_ns = first_edge(w, spec, wl->first + i);

		if (wl->mark[i] == WINDOW_SEEN && first_ns != NULL) {
			scratch->x[n] = i;
			scratch->y[n++] = wl->mono_ns[i] - *first_ns - asked_ns;
		}
	}
	if (statistics_line(scratch->x, scratch->y, n, scratch->scratch, &fit) < 0) {
		return;
	}
	ret->has |= SYNC0_HAS_SKEW;
	ret->skew_ns = llround(fit.offset);
	ret->skew_error_ns = (int64_t)ceil(fit.offset_error) + noise->bias_error_ns +
			     (is_pair ? 0 : llabs(noise->bias_ns));
}

void measure_window(const struct window *w, size_t number, const struct measure_spec *spec,
		    const struct judge_noise *noise, const struct measure_scratch *scratch,
		    struct sync0_result *ret)
{
	const struct window_line *wl = &w->line[number];
	int64_t base_ns = base_of(w, wl, spec->row);
	struct statistics_fit edges;

	count(w, wl, spec, ret);
	ret->first_cycle = (uint64_t)w->first_cycle;
	ret->step_ns = w->clock_step_ns != 0 ? w->clock_step_ns : wl->step_ns;
	ret->is_disturbed = w->clock_step_ns != 0;
	ret->dc_diff_ns = w->dc_diff_ns;
	if (ret->step_ns != 0) {
		return; /* two halves that do not belong together */
	}
	period(wl, scratch, ret);
	if (fit_edges(wl, spec->row, base_ns, scratch, &edges) < 0) {
		return;
	}
	ret->has |= SYNC0_HAS_DRIFT;
	ret->drift_ppb = -edges.slope * PPB / (double)spec->row->period_ns;
	ret->drift_error_ppb = edges.slope_error * PPB / (double)spec->row->period_ns;
	against_frames(w, wl, &edges, spec, scratch, ret);
	frame_distance(w, wl, spec, scratch, ret);
	if (number > 0) {
		skew(w, number, spec, noise, scratch, ret);
	}
}
