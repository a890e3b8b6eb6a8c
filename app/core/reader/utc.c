/* SPDX-License-Identifier: MIT */
#include "reader/utc.h"

#include <errno.h>
#include <stdlib.h>

#include "base/clock.h"

/* 2020-01-01: before this, nobody has set the clock since the board was made. */
#define CLOCK_UNSET_BEFORE_NS (INT64_C(1577836800) * NS_PER_S)
#define REPORT_NS NS_PER_S

enum time_base {
	TIME_UNKNOWN,
	TIME_DC,     /* the samples' DC time */
	TIME_CYCLES, /* no DC: cycle number times period stands in for it */
};

struct utc {
	struct timemap *map;
	uint64_t period_ns;
	enum time_base base;
	int32_t tai_offset_s;
	int64_t clock_error_ns; /* as in timemap_state */
	int64_t clock_estimate_ns;
	int has_reported;
	int64_t reported_dc_ns;
	uint64_t reported_steps;
};

struct utc *utc_create(const struct sample_meta *meta)
{
	struct utc *utc = calloc(1, sizeof(*utc));

	if (utc == NULL) {
		return NULL;
	}
	utc->period_ns = meta->period_ns;
	utc->tai_offset_s = meta->tai_offset_s;
	utc->clock_error_ns = -1;
	utc->clock_estimate_ns = -1;
	utc->map = timemap_create(meta->tai_offset_s);
	if (utc->map == NULL) {
		free(utc);
		return NULL;
	}
	return utc;
}

void utc_destroy(struct utc *utc)
{
	if (utc != NULL) {
		timemap_destroy(utc->map);
		free(utc);
	}
}

/* DC came or went: times before and after have nothing in common. */
static int set_base(struct utc *utc, const struct sample_header *h)
{
	enum time_base base = h->dc_time_ns != 0 ? TIME_DC : TIME_CYCLES;
	struct timemap *map;

	if (base == utc->base) {
		return 0;
	}
	if (utc->base != TIME_UNKNOWN) {
		map = timemap_create(utc->tai_offset_s);
		if (map == NULL) {
			return -ENOMEM;
		}
		timemap_destroy(utc->map);
		utc->map = map;
	}
	utc->base = base;
	utc->has_reported = 0;
	return 0;
}

/* Times of a sample are whatever its writer put there: timemap_feed() ignores what is no time. */
static int64_t add_ns(int64_t a, int64_t b)
{
	return (int64_t)((uint64_t)a + (uint64_t)b);
}

static void feed_map(struct utc *utc, const struct sample_header *h, int64_t time_ns)
{
	int64_t half_ns = h->round_trip_ns / 2;
	int64_t late_ns = h->wake_latency_ns > 0 ? h->wake_latency_ns : 0;

	if (utc->base == TIME_CYCLES) {
		timemap_feed(utc->map, time_ns, add_ns(h->wake_tai_ns, -late_ns), late_ns);
	} else if (h->frame_dc_ns != 0 && h->round_trip_ns >= 0) {
		/* The frame left right after the wake and passed the reference clock half a round
		 * trip later. */
		timemap_feed(utc->map, h->frame_dc_ns, add_ns(h->wake_tai_ns, half_ns), half_ns);
	}
}

int utc_feed(struct utc *utc, const struct sample_header *h, int64_t *ret_utc_ns)
{
	int r = set_base(utc, h);
	int64_t time_ns;

	if (r < 0) {
		return r;
	}
	time_ns = utc->base == TIME_DC ? h->dc_time_ns : (int64_t)(h->cycle * utc->period_ns);
	feed_map(utc, h, time_ns);
	*ret_utc_ns = timemap_is_ready(utc->map) ? timemap_utc_ns(utc->map, time_ns)
						 : timemap_tai_to_utc_ns(utc->map, h->wake_tai_ns);
	return 0;
}

enum utc_change utc_changed(struct utc *utc, struct timemap_state *ret_state)
{
	struct timemap_state state;
	int has_stepped;

	if (!timemap_is_ready(utc->map)) {
		return UTC_UNCHANGED;
	}
	timemap_get(utc->map, &state);
	has_stepped = utc->has_reported && state.steps != utc->reported_steps;
	if (utc->has_reported && !has_stepped && state.dc_ns >= utc->reported_dc_ns &&
	    state.dc_ns - utc->reported_dc_ns < REPORT_NS) {
		return UTC_UNCHANGED;
	}
	utc->has_reported = 1;
	utc->reported_dc_ns = state.dc_ns;
	utc->reported_steps = state.steps;
	state.clock_error_ns = utc->clock_error_ns;
	state.clock_estimate_ns = utc->clock_estimate_ns;
	*ret_state = state;
	return has_stepped ? UTC_STEPPED : UTC_UPDATED;
}

int64_t utc_of_tai(const struct utc *utc, int64_t tai_ns)
{
	return timemap_tai_to_utc_ns(utc->map, tai_ns);
}

void utc_note_tai_offset(struct utc *utc, int32_t tai_offset_s)
{
	utc->tai_offset_s = tai_offset_s;
	timemap_note_tai_offset(utc->map, tai_offset_s);
}

void utc_note_clock(struct utc *utc, const struct clock_quality *quality)
{
	utc_note_tai_offset(utc, quality->tai_offset_s);
	utc->clock_error_ns = quality->is_disciplined ? quality->error_ns : -1;
	utc->clock_estimate_ns = quality->is_disciplined ? quality->estimate_ns : -1;
}

const char *utc_quality(const struct timemap_state *state)
{
	if (state->utc_ns < CLOCK_UNSET_BEFORE_NS) {
		return "unset";
	}
	return state->tai_offset_s == 0 ? "utc" : "tai";
}

const char *utc_explain(const struct timemap_state *state)
{
	if (state->utc_ns < CLOCK_UNSET_BEFORE_NS) {
		return "the wall clock was never set: utc_ns is meaningless until it is";
	}
	return state->tai_offset_s == 0
		       ? "the kernel's TAI offset is not set: CLOCK_TAI is taken for UTC"
		       : "UTC from CLOCK_TAI and the kernel's TAI offset";
}
