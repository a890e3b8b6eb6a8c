/* SPDX-License-Identifier: MIT */
/*
 * The map from DC time to UTC. DC time counts in the reference slave's scale, whatever that is; the
 * host's clock is read beside it in every cycle. The map fits offset and rate over ten seconds of
 * such pairs (medians of short blocks, then the median of slopes: a burst of late wakes does not
 * bend it) and slews towards the fit: between steps, UTC never runs backwards. When the host's
 * clock is set, the map takes one marked step. Samples already mapped are never mapped again.
 */
#ifndef BASE_TIMEMAP_H
#define BASE_TIMEMAP_H

#include <stdint.h>

/* The map differs this much from two blocks of pairs in a row: the clock was set, step. */
#define TIMEMAP_STEP_LIMIT_NS INT64_C(10000000)

struct timemap;

/* utc = utc_ns + (dc - dc_ns) * (1 + rate_ppb / 1e9), until the next state. */
struct timemap_state {
	int64_t dc_ns;
	int64_t utc_ns;         /* Unix ns; CLOCK_TAI itself where tai_offset_s is 0 */
	int64_t rate_ppb;       /* UTC against DC, slewing included */
	int64_t uncertainty_ns; /* of utc_ns against the host's clock: path and scatter, not the
				   host's error */
	int64_t step_ns;        /* size of the newest step, positive: UTC jumped forward */
	uint64_t steps;         /* times the map stepped */
	/* Of the host's clock against UTC, at most and probably, as reader/utc.h was told; -1:
	 * nothing disciplines it, or not known. */
	int64_t clock_error_ns;
	int64_t clock_estimate_ns;
	int32_t tai_offset_s; /* TAI - UTC in use; 0: the kernel's is unset and CLOCK_TAI is UTC */
};

/** Before the first pair. */
static inline struct timemap_state timemap_state_unknown(int32_t tai_offset_s)
{
	return (struct timemap_state){ .clock_error_ns = -1,
				       .clock_estimate_ns = -1,
				       .tai_offset_s = tai_offset_s };
}

enum timemap_news {
	TIMEMAP_QUIET,   /* nothing new */
	TIMEMAP_UPDATED, /* a new state, in line with the one before */
	TIMEMAP_STEPPED, /* a new state, a step away from the one before */
};

/** NULL with errno. @tai_offset_s as in the ring's meta. Free with timemap_destroy(). */
struct timemap *timemap_create(int32_t tai_offset_s);
void timemap_destroy(struct timemap *map);

/**
 * Feed one pair: at DC time @dc_ns the host's CLOCK_TAI read @tai_ns, known latency already taken
 * off; what remains unknown of it (half a round trip) is @latency_ns. Context: any but the cycle.
 */
enum timemap_news timemap_feed(struct timemap *map, int64_t dc_ns, int64_t tai_ns,
			       int64_t latency_ns);

/**
 * The kernel's TAI offset is @tai_offset_s now. If CLOCK_TAI jumps by just that difference (chrony
 * has set the offset), UTC went on and the map takes no step.
 */
void timemap_note_tai_offset(struct timemap *map, int32_t tai_offset_s);

/** 1 as soon as one pair was fed. */
int timemap_is_ready(const struct timemap *map);

/** UTC at @dc_ns, Unix ns. The map must be ready. */
int64_t timemap_utc_ns(const struct timemap *map, int64_t dc_ns);

/** CLOCK_TAI to UTC with the offset in use. */
int64_t timemap_tai_to_utc_ns(const struct timemap *map, int64_t tai_ns);

void timemap_get(const struct timemap *map, struct timemap_state *ret_state);

#endif
