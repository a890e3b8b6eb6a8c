/* SPDX-License-Identifier: MIT */
/*
 * The period of a signal: between the places at which it passes its mean upwards. Noise near the
 * mean is no place: before each, the value has to be below the mean by a tenth of its span.
 * Context: any.
 */
#ifndef WEB_PERIOD_H
#define WEB_PERIOD_H

#include <stdint.h>

struct period {
	double mean;
	double arm; /* below it the next place counts */
	int is_armed;
	int has_before;
	uint64_t cycle_before;
	double value_before;
	/* Of the samples since the last gap, and of the part without a gap that has most periods.
	 */
	double first;
	double last;
	uint32_t places;
	double best_cycles; /* of one period */
	uint32_t best_places;
};

/** @mean, @min and @max of the values that follow. */
void period_begin(struct period *period, double mean, double min, double max);
/** The value of @cycle; NaN: there is none. Across a gap nothing is counted. */
void period_add(struct period *period, uint64_t cycle, double value);
/** In cycles; NaN: less than one was seen. */
double period_cycles(const struct period *period);

#endif
