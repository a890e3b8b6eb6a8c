/* SPDX-License-Identifier: MIT */
/*
 * A histogram of ns values that never allocates: 32 buckets an octave (3 % wide), values 0 to 2^40
 * ns. One writer, any number of readers, also across processes (it is part of the status page):
 * every field is a relaxed atomic. Context of histogram_add(): RT-safe; of the rest: any.
 */
#ifndef BASE_HISTOGRAM_H
#define BASE_HISTOGRAM_H

#include <stdatomic.h>
#include <stdint.h>

enum { HISTOGRAM_SUB_BITS = 5, HISTOGRAM_OCTAVES = 36 };
enum { HISTOGRAM_BUCKETS = HISTOGRAM_OCTAVES << HISTOGRAM_SUB_BITS };

struct histogram {
	_Atomic uint64_t count;                     /* [writer] */
	_Atomic int64_t min_ns;                     /* [writer] signed, as added */
	_Atomic int64_t max_ns;                     /* [writer] signed, as added */
	_Atomic int64_t sum_ns;                     /* [writer] signed, as added */
	_Atomic uint32_t bucket[HISTOGRAM_BUCKETS]; /* [writer] by magnitude */
};

/** Count @value_ns; buckets go by magnitude: percentiles of a signed error are of |error|. */
void histogram_add(struct histogram *h, int64_t value_ns);

/**
 * The smallest value that @per_million millionths of the values do not exceed (500000: median), by
 * magnitude, within 3 %; never above the largest magnitude seen. 0 when empty.
 */
int64_t histogram_percentile(const struct histogram *h, uint32_t per_million);

/** The largest magnitude seen. */
int64_t histogram_max_magnitude(const struct histogram *h);

void histogram_clear(struct histogram *h);

/** Lower bound of @bucket, ns. */
int64_t histogram_bucket_floor(unsigned bucket);

#endif
