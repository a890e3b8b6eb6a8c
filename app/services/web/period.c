/* SPDX-License-Identifier: MIT */
#include "web/period.h"

#include <math.h>

#define ARM_SHARE 0.1

void period_begin(struct period *p, double mean, double min, double max)
{
	*p = (struct period){ .mean = mean, .arm = mean - ARM_SHARE * (max - min) };
}

/* From the newest part without a gap. */
static void keep_best(struct period *p)
{
	if (p->places >= 2 && p->places > p->best_places) {
		p->best_places = p->places;
		p->best_cycles = (p->last - p->first) / (p->places - 1);
	}
}

static void begin_part(struct period *p)
{
	p->is_armed = 0;
	p->has_before = 0;
	p->places = 0;
}

void period_add(struct period *p, uint64_t cycle, double value)
{
	if (isnan(value) || (p->has_before && cycle != p->cycle_before + 1)) {
		begin_part(p);
	}
	if (isnan(value)) {
		return;
	}
	if (p->is_armed && value >= p->mean) {
		/* Between both samples, on a straight line. Armed: the one before is lower. */
		p->last = (double)p->cycle_before +
			  (p->mean - p->value_before) / (value - p->value_before);
		p->first = p->places == 0 ? p->last : p->first;
		p->places++;
		p->is_armed = 0;
		keep_best(p);
	}
	p->is_armed |= value < p->arm;
	p->has_before = 1;
	p->cycle_before = cycle;
	p->value_before = value;
}

double period_cycles(const struct period *p)
{
	return p->best_places < 2 ? (double)NAN : p->best_cycles;
}
