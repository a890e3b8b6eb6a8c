/* SPDX-License-Identifier: MIT */
#include "timemap.h"

#include <stdlib.h>
#include <string.h>

#include "clock.h"

enum { BLOCKS = 40, PAIRS = 63, SLOPES = BLOCKS * (BLOCKS - 1) / 2 };

#define BLOCK_NS (NS_PER_S / 4)
#define PAIR_NS (BLOCK_NS / PAIRS)   /* pairs closer than this are left out */
#define BLOCK_GAP_NS (10 * NS_PER_S) /* without a pair for this long the window is stale */
#define SLEW_TIME_NS 2e9             /* time over which an error is slewed to zero */
#define SLEW_LIMIT 2e-3              /* never faster than this */
#define RATE_LIMIT 1e-3              /* quartz is far better: a larger slope is noise */
#define RATE_BLOCKS 8                /* a slope over less is noise */

/* One block's median: at dc_ns, UTC minus DC was offset_ns. */
struct block {
	int64_t dc_ns;
	int64_t offset_ns;
};

struct timemap {
	struct timemap_state state;
	int is_ready;
	double rate;     /* state.rate_ppb, unrounded */
	double rate_fit; /* the newest trusted slope: it outlives a step */
	int32_t tai_offset_next_s;
	struct block pair[PAIRS]; /* of the block being filled */
	int64_t latency_ns[PAIRS];
	size_t pair_count;
	int64_t block_start_ns;
	struct block block[BLOCKS];
	size_t block_count;
	struct block suspect; /* a block away from the map: a second one makes it a step */
	int has_suspect;
	double slope[SLOPES]; /* scratch */
};

struct timemap *timemap_create(int32_t tai_offset_s)
{
	struct timemap *map = calloc(1, sizeof(*map));

	if (map != NULL) {
		map->state = timemap_state_unknown(tai_offset_s);
		map->tai_offset_next_s = tai_offset_s;
	}
	return map;
}

void timemap_destroy(struct timemap *map)
{
	free(map);
}

static int by_number(const void *a, const void *b)
{
	int64_t x = *(const int64_t *)a;
	int64_t y = *(const int64_t *)b;

	return (x > y) - (x < y);
}

/* The upper median of @n numbers, 1 or more, whose order is changed: Hoare's selection. A sort of
 * all slopes would be a twelfth of the recorder's processor time. */
static double median(double *v, size_t n)
{
	size_t low = 0;
	size_t high = n - 1;

	while (low < high) {
		double pivot = v[low + (high - low) / 2];
		size_t i = low;
		size_t j = high;

		for (;;) {
			double other;

			while (v[i] < pivot) {
				i++;
			}
			while (v[j] > pivot) {
				j--;
			}
			if (i >= j) {
				break;
			}
			other = v[i];
			v[i++] = v[j];
			v[j--] = other;
		}
		/* Up to j none is above the pivot, behind it none below. */
		if (n / 2 <= j) {
			high = j;
		} else {
			low = j + 1;
		}
	}
	return v[n / 2];
}

static int by_offset(const void *a, const void *b)
{
	int64_t x = ((const struct block *)a)->offset_ns;
	int64_t y = ((const struct block *)b)->offset_ns;

	return (x > y) - (x < y);
}

static int64_t magnitude(int64_t n)
{
	return n < 0 ? -n : n;
}

/* Bounds with which no sum below overflows: 73 years of DC time, UTC until 2067. */
static int dc_is_sane(int64_t ns)
{
	return ns > -INT64_MAX / 4 && ns < INT64_MAX / 4;
}

static int tai_is_sane(int64_t ns)
{
	return ns > -INT64_MAX / 3 && ns < INT64_MAX / 3;
}

int64_t timemap_utc_ns(const struct timemap *map, int64_t dc_ns)
{
	int64_t since = (dc_is_sane(dc_ns) ? dc_ns : map->state.dc_ns) - map->state.dc_ns;

	return map->state.utc_ns + since + (int64_t)((double)since * map->rate);
}

int64_t timemap_tai_to_utc_ns(const struct timemap *map, int64_t tai_ns)
{
	return (tai_is_sane(tai_ns) ? tai_ns : 0) - map->state.tai_offset_s * NS_PER_S;
}

int timemap_is_ready(const struct timemap *map)
{
	return map->is_ready;
}

void timemap_get(const struct timemap *map, struct timemap_state *ret_state)
{
	*ret_state = map->state;
}

void timemap_note_tai_offset(struct timemap *map, int32_t tai_offset_s)
{
	map->tai_offset_next_s = tai_offset_s;
}

static void set_state(struct timemap *map, int64_t dc_ns, int64_t utc_ns, double rate)
{
	map->state.dc_ns = dc_ns;
	map->state.utc_ns = utc_ns;
	map->state.rate_ppb = (int64_t)(rate * 1e9 + (rate < 0 ? -0.5 : 0.5));
	map->rate = rate;
}

/* The median of the pairs, as one block; *ret_latency_ns that of their latencies. */
static struct block block_of_pairs(struct timemap *map, int64_t *ret_latency_ns)
{
	qsort(map->pair, map->pair_count, sizeof(map->pair[0]), by_offset);
	qsort(map->latency_ns, map->pair_count, sizeof(map->latency_ns[0]), by_number);
	*ret_latency_ns = map->latency_ns[map->pair_count / 2];
	return map->pair[map->pair_count / 2];
}

static void add_block(struct timemap *map, struct block b)
{
	if (map->block_count == BLOCKS) {
		memmove(map->block, map->block + 1, (BLOCKS - 1) * sizeof(map->block[0]));
		map->block_count--;
	}
	map->block[map->block_count++] = b;
}

/* Theil and Sen: the median of the slopes between all pairs of blocks. */
static double fit_rate(struct timemap *map)
{
	size_t n = 0;
	double rate;

	if (map->block_count < RATE_BLOCKS) {
		return map->rate_fit;
	}
	for (size_t i = 0; i < map->block_count; i++) {
		for (size_t j = i + 1; j < map->block_count; j++) {
			const struct block *a = &map->block[i];
			const struct block *b = &map->block[j];

			if (b->dc_ns > a->dc_ns) {
				map->slope[n++] = (double)(b->offset_ns - a->offset_ns) /
						  (double)(b->dc_ns - a->dc_ns);
			}
		}
	}
	if (n == 0) {
		return map->rate_fit;
	}
	rate = median(map->slope, n);
	map->rate_fit = rate > RATE_LIMIT ? RATE_LIMIT : rate < -RATE_LIMIT ? -RATE_LIMIT : rate;
	return map->rate_fit;
}

/* UTC minus DC at @dc_ns by the fit; *ret_scatter_ns is the median of the blocks' distances to it.
 */
static int64_t fit_offset(struct timemap *map, double rate, int64_t dc_ns, int64_t *ret_scatter_ns)
{
	int64_t residual[BLOCKS];
	int64_t offset_ns;

	for (size_t i = 0; i < map->block_count; i++) {
		residual[i] = map->block[i].offset_ns +
			      (int64_t)((double)(dc_ns - map->block[i].dc_ns) * rate);
	}
	qsort(residual, map->block_count, sizeof(residual[0]), by_number);
	offset_ns = residual[map->block_count / 2];
	for (size_t i = 0; i < map->block_count; i++) {
		residual[i] = magnitude(residual[i] - offset_ns);
	}
	qsort(residual, map->block_count, sizeof(residual[0]), by_number);
	*ret_scatter_ns = residual[map->block_count / 2];
	return offset_ns;
}

/* Continue from the present map, at a rate that reduces the error to zero. */
static void slew_to_fit(struct timemap *map, int64_t dc_ns, int64_t latency_ns)
{
	int64_t scatter_ns;
	double rate = fit_rate(map);
	int64_t wanted_ns = dc_ns + fit_offset(map, rate, dc_ns, &scatter_ns);
	int64_t utc_ns = timemap_utc_ns(map, dc_ns);
	double slew = (double)(wanted_ns - utc_ns) / SLEW_TIME_NS;

	slew = slew > SLEW_LIMIT ? SLEW_LIMIT : slew < -SLEW_LIMIT ? -SLEW_LIMIT : slew;
	set_state(map, dc_ns, utc_ns, rate + slew);
	/* 4.5 median deviations are 3 sigma of normal scatter; what is still to be slewed counts,
	 * too. */
	map->state.uncertainty_ns = latency_ns + scatter_ns * 9 / 2 + magnitude(wanted_ns - utc_ns);
}

/* The clock was set: discard the window, restart from the two blocks that show it. */
static enum timemap_news take_step(struct timemap *map, struct block b, int64_t latency_ns)
{
	int64_t before_ns = timemap_utc_ns(map, b.dc_ns);
	int64_t step_ns = b.dc_ns + b.offset_ns - before_ns;
	int64_t offset_change_ns = (map->tai_offset_next_s - map->state.tai_offset_s) * NS_PER_S;

	map->block_count = 0;
	map->has_suspect = 0;
	if (offset_change_ns != 0 &&
	    magnitude(step_ns - offset_change_ns) < TIMEMAP_STEP_LIMIT_NS) {
		map->state.tai_offset_s = map->tai_offset_next_s;
		b.offset_ns -= offset_change_ns;
		add_block(map, b);
		slew_to_fit(map, b.dc_ns, latency_ns);
		return TIMEMAP_UPDATED;
	}
	add_block(map, b);
	set_state(map, b.dc_ns, b.dc_ns + b.offset_ns, map->rate_fit);
	map->state.uncertainty_ns = latency_ns;
	map->state.steps++;
	map->state.step_ns = step_ns;
	return TIMEMAP_STEPPED;
}

static enum timemap_news close_block(struct timemap *map)
{
	int64_t latency_ns;
	struct block b = block_of_pairs(map, &latency_ns);
	int64_t error_ns = b.dc_ns + b.offset_ns - timemap_utc_ns(map, b.dc_ns);

	map->pair_count = 0;
	if (magnitude(error_ns) <= TIMEMAP_STEP_LIMIT_NS) {
		map->has_suspect = 0;
		add_block(map, b);
		slew_to_fit(map, b.dc_ns, latency_ns);
		return TIMEMAP_UPDATED;
	}
	if (map->has_suspect &&
	    magnitude(b.offset_ns - map->suspect.offset_ns) < TIMEMAP_STEP_LIMIT_NS) {
		return take_step(map, b, latency_ns);
	}
	map->suspect = b;
	map->has_suspect = 1;
	return TIMEMAP_QUIET;
}

enum timemap_news timemap_feed(struct timemap *map, int64_t dc_ns, int64_t tai_ns,
			       int64_t latency_ns)
{
	enum timemap_news news = TIMEMAP_QUIET;
	struct block *last = map->pair_count > 0 ? &map->pair[map->pair_count - 1] : NULL;
	int64_t utc_ns;

	if (!dc_is_sane(dc_ns) || !tai_is_sane(tai_ns) || !dc_is_sane(latency_ns)) {
		return TIMEMAP_QUIET;
	}
	utc_ns = timemap_tai_to_utc_ns(map, tai_ns);
	if (!map->is_ready) {
		map->is_ready = 1;
		map->block_start_ns = dc_ns;
		set_state(map, dc_ns, utc_ns, 0);
		map->state.uncertainty_ns = latency_ns;
		news = TIMEMAP_UPDATED;
	}
	if (dc_ns < map->block_start_ns || dc_ns - map->block_start_ns > BLOCK_GAP_NS) {
		/* DC time was set, or pairs were missing for long: these two are unrelated. */
		map->pair_count = 0;
		map->block_count = 0;
		map->block_start_ns = dc_ns;
		last = NULL;
	}
	if (map->pair_count > 0 && dc_ns - map->block_start_ns >= BLOCK_NS) {
		news = close_block(map);
		map->block_start_ns = dc_ns;
		last = NULL;
	}
	if (map->pair_count < PAIRS && (last == NULL || dc_ns - last->dc_ns >= PAIR_NS)) {
		map->pair[map->pair_count] = (struct block){ dc_ns, utc_ns - dc_ns };
		map->latency_ns[map->pair_count++] = latency_ns;
	}
	return news;
}
