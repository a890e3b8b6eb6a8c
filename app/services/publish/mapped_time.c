/* SPDX-License-Identifier: MIT */
#include "publish/mapped_time.h"

#include <errno.h>
#include <stdlib.h>

#include "base/clock.h"

/* 2020-01-01: before this, nobody has set the clock since the board was made. */
#define CLOCK_UNSET_BEFORE_NS (INT64_C(1577836800) * NS_PER_S)

enum time_base {
	TIME_UNKNOWN,
	TIME_DC,     /* the samples' DC time */
	TIME_CYCLES, /* no DC: cycle number times period stands in for it */
};

struct mapped_time {
	const struct sample_meta *meta;
	struct timemap *map;
	enum time_base base;
	int32_t tai_offset_s;
	int has_told;
	int64_t told_dc_ns;
	uint64_t told_steps;
};

struct mapped_time *mapped_time_create(const struct sample_meta *meta)
{
	struct mapped_time *mt = calloc(1, sizeof(*mt));

	if (mt == NULL) {
		return NULL;
	}
	mt->meta = meta;
	mt->tai_offset_s = meta->tai_offset_s;
	mt->map = timemap_create(meta->tai_offset_s);
	if (mt->map == NULL) {
		free(mt);
		return NULL;
	}
	return mt;
}

void mapped_time_destroy(struct mapped_time *mt)
{
	if (mt != NULL) {
		timemap_destroy(mt->map);
		free(mt);
	}
}

/* DC came or went: times before and after have nothing in common. */
static int set_base(struct mapped_time *mt, const struct sample_header *h)
{
	enum time_base base = h->dc_time_ns != 0 ? TIME_DC : TIME_CYCLES;
	struct timemap *map;

	if (base == mt->base) {
		return 0;
	}
	if (mt->base != TIME_UNKNOWN) {
		map = timemap_create(mt->tai_offset_s);
		if (map == NULL) {
			return -ENOMEM;
		}
		timemap_destroy(mt->map);
		mt->map = map;
	}
	mt->base = base;
	mt->has_told = 0;
	return 0;
}

static void feed(struct mapped_time *mt, const struct sample_header *h, int64_t time_ns)
{
	int64_t half_ns = h->round_trip_ns / 2;
	int64_t late_ns = h->wake_latency_ns > 0 ? h->wake_latency_ns : 0;

	if (mt->base == TIME_CYCLES) {
		timemap_feed(mt->map, time_ns, h->wake_tai_ns - late_ns, late_ns);
	} else if (h->frame_dc_ns != 0 && h->round_trip_ns >= 0) {
		/* The frame left right after the wake and passed the reference clock half a round
		 * trip later. */
		timemap_feed(mt->map, h->frame_dc_ns, h->wake_tai_ns + half_ns, half_ns);
	}
}

int mapped_time_feed(struct mapped_time *mt, const struct sample_header *h, int64_t *ret_utc_ns)
{
	int r = set_base(mt, h);
	int64_t time_ns;

	if (r < 0) {
		return r;
	}
	time_ns = mt->base == TIME_DC ? h->dc_time_ns : (int64_t)(h->cycle * mt->meta->period_ns);
	feed(mt, h, time_ns);
	*ret_utc_ns = timemap_is_ready(mt->map) ? timemap_utc_ns(mt->map, time_ns)
						: timemap_tai_to_utc_ns(mt->map, h->wake_tai_ns);
	return 0;
}

int64_t mapped_time_of_tai(const struct mapped_time *mt, int64_t tai_ns)
{
	return timemap_tai_to_utc_ns(mt->map, tai_ns);
}

void mapped_time_note_tai_offset(struct mapped_time *mt, int32_t tai_offset_s)
{
	mt->tai_offset_s = tai_offset_s;
	timemap_note_tai_offset(mt->map, tai_offset_s);
}

int mapped_time_news(struct mapped_time *mt, struct timemap_state *ret)
{
	struct timemap_state state;

	if (!timemap_is_ready(mt->map)) {
		return 0;
	}
	timemap_get(mt->map, &state);
	if (mt->has_told && state.steps == mt->told_steps && state.dc_ns >= mt->told_dc_ns &&
	    state.dc_ns - mt->told_dc_ns < NS_PER_S) {
		return 0;
	}
	mt->has_told = 1;
	mt->told_dc_ns = state.dc_ns;
	mt->told_steps = state.steps;
	*ret = state;
	return 1;
}

const char *mapped_time_quality(const struct timemap_state *state)
{
	if (state->utc_ns < CLOCK_UNSET_BEFORE_NS) {
		return "unset";
	}
	return state->tai_offset_s == 0 ? "utc" : "tai";
}

const char *mapped_time_explain(const struct timemap_state *state)
{
	if (state->utc_ns < CLOCK_UNSET_BEFORE_NS) {
		return "the wall clock was never set, utc_ns means nothing until it is";
	}
	return state->tai_offset_s == 0
		       ? "the kernel's TAI offset is unset, CLOCK_TAI is taken for UTC"
		       : "UTC from CLOCK_TAI and the kernel's TAI offset";
}
