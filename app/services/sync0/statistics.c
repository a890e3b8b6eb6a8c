/* SPDX-License-Identifier: MIT */
#include "sync0/statistics.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>

enum { BLOCKS_MAX = 32, POINTS_MIN = 8, PASSES = 2 };

#define MEDIAN_EFFICIENCY 1.2533 /* sqrt(pi / 2): of a median against a mean, normal noise */
#define MAD_TO_SIGMA 1.4826
#define BOUND 4.0            /* sigmas */
#define SLOPE_EFFICIENCY 1.5 /* of slopes between medians against least squares */

static int by_number(const void *a, const void *b)
{
	int64_t x = *(const int64_t *)a;
	int64_t y = *(const int64_t *)b;

	return (x > y) - (x < y);
}

static int by_real(const void *a, const void *b)
{
	double x = *(const double *)a;
	double y = *(const double *)b;

	return (x > y) - (x < y);
}

void statistics_sort(int64_t *v, size_t count)
{
	qsort(v, count, sizeof(v[0]), by_number);
}

int64_t statistics_percentile(const int64_t *v, size_t count, uint32_t per_million)
{
	size_t n = (size_t)((uint64_t)count * per_million / 1000000);

	return count == 0 ? 0 : v[n < count ? n : count - 1];
}

int64_t statistics_median(int64_t *v, size_t count)
{
	statistics_sort(v, count);
	return statistics_percentile(v, count, 500000);
}

static double magnitude(double v)
{
	return v < 0 ? -v : v;
}

struct block {
	double x;
	double y;
};

/* Points and the line that is already taken off them: within a block they must not run away. */
struct points {
	const uint32_t *x;
	const int64_t *y;
	size_t count;
	double slope;
};

static size_t make_blocks(const struct points *p, int64_t *scratch, struct block block[BLOCKS_MAX])
{
	size_t count = p->count;
	size_t blocks = count / 4 < BLOCKS_MAX ? count / 4 : BLOCKS_MAX;

	for (size_t b = 0; b < blocks; b++) {
		size_t from = count * b / blocks;
		size_t to = count * (b + 1) / blocks;
		double sum = 0;

		for (size_t i = from; i < to; i++) {
			scratch[i - from] =
				p->y[i] - llround(p->slope * ((double)p->x[i] - (double)p->x[0]));
			sum += p->x[i];
		}
		block[b].x = sum / (double)(to - from);
		block[b].y = (double)statistics_median(scratch, to - from);
	}
	return blocks;
}

static double slope_of(const struct block *block, size_t blocks)
{
	double slope[BLOCKS_MAX * (BLOCKS_MAX - 1) / 2];
	size_t n = 0;

	for (size_t i = 0; i < blocks; i++) {
		for (size_t j = i + 1; j < blocks; j++) {
			if (block[j].x > block[i].x) {
				slope[n++] = (block[j].y - block[i].y) / (block[j].x - block[i].x);
			}
		}
	}
	qsort(slope, n, sizeof(slope[0]), by_real);
	return n == 0 ? 0 : slope[n / 2];
}

int statistics_line(const uint32_t *x, const int64_t *y, size_t count, int64_t *scratch,
		    struct statistics_fit *ret_fit)
{
	struct block block[BLOCKS_MAX];
	struct points p = { .x = x, .y = y, .count = count };
	struct statistics_fit fit = { .count = count };
	int64_t middle;

	if (count < POINTS_MIN) {
		return -ENODATA;
	}
	for (int pass = 0; pass < PASSES; pass++) {
		p.slope += slope_of(block, make_blocks(&p, scratch, block));
	}
	fit.slope = p.slope;
	fit.centre = ((double)x[0] + (double)x[count - 1]) / 2;
	for (size_t i = 0; i < count; i++) {
		scratch[i] = y[i] - llround(fit.slope * ((double)x[i] - fit.centre));
	}
	middle = statistics_median(scratch, count);
	fit.offset = (double)middle;
	for (size_t i = 0; i < count; i++) {
		scratch[i] = llabs(scratch[i] - middle);
	}
	/* Half a nanosecond: what rounding leaves when all are alike. */
	fit.sigma = MAD_TO_SIGMA * (double)statistics_median(scratch, count) + 0.5;
	fit.offset_error = BOUND * MEDIAN_EFFICIENCY * fit.sigma / sqrt((double)count);
	fit.slope_error =
		fit.offset_error * sqrt(12.0) / magnitude((double)x[count - 1] - (double)x[0] + 1);
	*ret_fit = fit;
	return 0;
}
