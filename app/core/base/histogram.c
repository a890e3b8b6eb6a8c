/* SPDX-License-Identifier: MIT */
#include "histogram.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)
#define SET(field, v) atomic_store_explicit(&(field), (v), memory_order_relaxed)

static unsigned bucket_of(uint64_t v)
{
	unsigned octave;
	unsigned index;

	if (v < (1u << HISTOGRAM_SUB_BITS)) {
		return (unsigned)v;
	}
	octave = 63u - (unsigned)__builtin_clzll(v) - HISTOGRAM_SUB_BITS;
	index = ((octave + 1) << HISTOGRAM_SUB_BITS) |
		((unsigned)(v >> octave) & ((1u << HISTOGRAM_SUB_BITS) - 1));
	return index < HISTOGRAM_BUCKETS ? index : HISTOGRAM_BUCKETS - 1;
}

int64_t histogram_bucket_floor(unsigned bucket)
{
	unsigned octave = bucket >> HISTOGRAM_SUB_BITS;
	int64_t sub = bucket & ((1u << HISTOGRAM_SUB_BITS) - 1);

	if (octave == 0) {
		return sub;
	}
	return (sub + (1 << HISTOGRAM_SUB_BITS)) << (octave - 1);
}

void histogram_add(struct histogram *h, int64_t value_ns)
{
	uint64_t count = GET(h->count);
	uint64_t magnitude = (uint64_t)(value_ns < 0 ? -value_ns : value_ns);
	unsigned b = bucket_of(magnitude);

	if (count == 0 || value_ns < GET(h->min_ns)) {
		SET(h->min_ns, value_ns);
	}
	if (count == 0 || value_ns > GET(h->max_ns)) {
		SET(h->max_ns, value_ns);
	}
	SET(h->sum_ns, GET(h->sum_ns) + value_ns);
	SET(h->bucket[b], GET(h->bucket[b]) + 1);
	SET(h->count, count + 1);
}

int64_t histogram_max_magnitude(const struct histogram *h)
{
	int64_t min = GET(h->min_ns);
	int64_t max = GET(h->max_ns);

	return -min > max ? -min : max;
}

int64_t histogram_percentile(const struct histogram *h, uint32_t per_million)
{
	uint64_t total = 0;
	uint64_t wanted;
	uint64_t seen = 0;
	int64_t max = histogram_max_magnitude(h);

	for (unsigned b = 0; b < HISTOGRAM_BUCKETS; b++) {
		total += GET(h->bucket[b]);
	}
	if (total == 0) {
		return 0;
	}
	wanted = (total * per_million + 999999) / 1000000;
	for (unsigned b = 0; b < HISTOGRAM_BUCKETS; b++) {
		seen += GET(h->bucket[b]);
		if (seen >= wanted && seen > 0) {
			int64_t ceiling = histogram_bucket_floor(b + 1) - 1;

			return ceiling < max ? ceiling : max;
		}
	}
	return max;
}

void histogram_clear(struct histogram *h)
{
	SET(h->count, 0);
	SET(h->min_ns, 0);
	SET(h->max_ns, 0);
	SET(h->sum_ns, 0);
	for (unsigned b = 0; b < HISTOGRAM_BUCKETS; b++) {
		SET(h->bucket[b], 0);
	}
}
