/* SPDX-License-Identifier: MIT */
/* Estimates that a few late interrupts do not bend. Context: any; they reorder what they are given.
 */
#ifndef SYNC0_STATISTICS_H
#define SYNC0_STATISTICS_H

#include <stddef.h>
#include <stdint.h>

/** Sorts @v. */
void statistics_sort(int64_t *v, size_t count);
/** The smallest of sorted @v that @per_million millionths do not exceed; 0 when empty. */
int64_t statistics_percentile(const int64_t *v, size_t count, uint32_t per_million);
/** The median of @v, sorting it; 0 when empty. */
int64_t statistics_median(int64_t *v, size_t count);

/* y = offset + slope * (x - centre) */
struct statistics_fit {
	size_t count;
	double centre;
	double offset; /* median of the residuals */
	double slope;
	double sigma;        /* 1.4826 * the median deviation */
	double offset_error; /* four sigma of the estimate */
	double slope_error;
};

/**
 * Fit @count points: slope by Theil and Sen over the medians of blocks, offset by the median.
 * @x ascends; @scratch holds @count values. 0, or -ENODATA with fewer than 8 points.
 */
int statistics_line(const uint32_t *x, const int64_t *y, size_t count, int64_t *scratch,
		    struct statistics_fit *ret_fit);

#endif
