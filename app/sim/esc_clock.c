/* SPDX-License-Identifier: MIT */
/*
 * The distributed clock: a crystal, an offset, and the time loop control that regulates the local copy of
 * the system time on each write to 0x0910. The rate correction is the data sheet's
 * D / (5 (S + D + 2) (S - D + 2)) with S = 0x0930 and D = 0x0932; how D follows the measured difference
 * is our model (SPECNOTES): proportional with 2^-5 a write, integral with 2^-filter (0x0935).
 */
#include "sim/esc_inside.h"

#include <math.h>

#define PROPORTIONAL 0x1p-5
#define COMPARE_MIN_NS 10000.0
#define COMPARE_MAX_NS 4000000.0

static double rate(const struct esc_clock *c)
{
	return (1.0 + c->ppm * 1e-6) * (1.0 + c->correction);
}

uint64_t esc_local_time(const struct esc *esc, int64_t t_ns)
{
	const struct esc_clock *c = &esc->clock;
	int64_t dt = t_ns - c->base_true_ns;

	/* The whole part apart from the small one: a double has not the digits for both. */
	return c->base_local_ns + (uint64_t)dt +
	       (uint64_t)(int64_t)floor((double)dt * (rate(c) - 1.0) + c->base_fraction);
}

uint64_t esc_system_time(const struct esc *esc, int64_t t_ns)
{
	uint64_t s = esc_local_time(esc, t_ns) + esc->clock.offset_ns;

	return esc->features.dc == ESC_DC_32 ? s & UINT32_MAX : s;
}

static uint64_t time_since(const struct esc *esc, int64_t t_ns, uint64_t start)
{
	uint64_t since = esc_system_time(esc, t_ns) - start;

	return esc->features.dc == ESC_DC_32 ? (uint32_t)since : since;
}

int64_t esc_clock_when(const struct esc *esc, int64_t t_ns, uint64_t system_ns)
{
	uint64_t now = esc_system_time(esc, t_ns);
	uint64_t left = system_ns - now;
	int64_t guess;

	/* With 32 bits a time that is past comes again; with 64 it never does. */
	if (esc->features.dc == ESC_DC_32) {
		left = (uint32_t)left;
	}
	if (left > INT64_MAX / 4) {
		return INT64_MAX;
	}
	guess = t_ns + (int64_t)ceil((double)left / rate(&esc->clock));
	/* The clock is in whole ns: step to the first instant at which it shows the time. */
	while (guess > t_ns && time_since(esc, guess - 1, now) >= left) {
		guess--;
	}
	while (time_since(esc, guess, now) < left) {
		guess++;
	}
	return guess;
}

static void rebase(struct esc_clock *c, int64_t t_ns)
{
	int64_t dt = t_ns - c->base_true_ns;
	double small = (double)dt * (rate(c) - 1.0) + c->base_fraction;
	double whole = floor(small);

	c->base_local_ns += (uint64_t)dt + (uint64_t)(int64_t)whole;
	c->base_fraction = small - whole;
	c->base_true_ns = t_ns;
}

void esc_clock_start(struct esc *esc, int64_t t_ns, uint64_t local_ns, double ppm)
{
	esc->clock = (struct esc_clock){ .ppm = ppm, .base_true_ns = t_ns, .base_local_ns = local_ns };
	esc_clock_reset_filter(esc);
}

void esc_clock_drift(struct esc *esc, int64_t t_ns, double ppm)
{
	rebase(&esc->clock, t_ns);
	esc->clock.ppm = ppm;
	esc_sync_replan(esc, t_ns);
}

void esc_clock_reset_filter(struct esc *esc)
{
	struct esc_clock *c = &esc->clock;

	c->time_filter = esc->reg[ESC_REG_DC_TIME_FILTER] & 0x0f;
	c->speed_filter = esc->reg[ESC_REG_DC_SPEED_FILTER] & 0x0f;
	c->speed_start = get_le16(esc->reg + ESC_REG_DC_SPEED_COUNTER_START) & 0x7fff;
	c->diff_filtered_ns = 0;
	c->integral = 0;
	esc_clock_to_registers(esc);
}

/* The D whose rate is nearest to @wanted, within the data sheet's range. */
static double speed_diff(uint16_t speed_start, double wanted)
{
	double s = (double)speed_start + 2.0;
	double limit = fmax(0.0, (double)speed_start - 127.0);
	double k = 5.0 * fabs(wanted);
	double d = k < 1e-15 ? 0.0 : (-1.0 + sqrt(1.0 + 4.0 * k * k * s * s)) / (2.0 * k);

	return copysign(fmin(round(d), limit), wanted);
}

static double rate_of(uint16_t speed_start, double d)
{
	double s = (double)speed_start + 2.0;

	return d / (5.0 * (s + d) * (s - d));
}

void esc_clock_compare(struct esc *esc, int64_t t_ns, uint64_t received_ns)
{
	struct esc_clock *c = &esc->clock;
	uint64_t delay = get_le32(esc->reg + ESC_REG_DC_SYSTEM_TIME_DELAY);
	int64_t diff_ns = (int64_t)(received_ns + delay - esc_system_time(esc, t_ns));
	double since_ns = (double)(t_ns - c->last_compare_true_ns);
	double wanted;

	if (esc->features.dc == ESC_DC_32) {
		diff_ns = (int32_t)(uint32_t)diff_ns;
	}
	c->diff_filtered_ns += ((double)diff_ns - c->diff_filtered_ns) / (double)(1u << c->time_filter);
	if (since_ns > 0) {
		double step = (double)diff_ns / fmin(fmax(since_ns, COMPARE_MIN_NS), COMPARE_MAX_NS);

		rebase(c, t_ns);
		step = fmax(-1e-3, fmin(1e-3, step));
		c->integral += step / (double)(1u << c->speed_filter);
		c->integral = fmax(-7e-4, fmin(7e-4, c->integral));
		wanted = c->integral + PROPORTIONAL * step;
		c->correction = rate_of(c->speed_start, speed_diff(c->speed_start, wanted));
		c->last_compare_true_ns = t_ns;
		esc_sync_replan(esc, t_ns);
	}
}

void esc_clock_to_registers(struct esc *esc)
{
	const struct esc_clock *c = &esc->clock;
	double magnitude = fmin(fabs(c->diff_filtered_ns), (double)INT32_MAX);
	double d = speed_diff(c->speed_start, c->correction);

	/* Bit 31: the local copy is behind the time received. */
	put_le32(esc->reg + ESC_REG_DC_SYSTEM_TIME_DIFF,
		 (uint32_t)magnitude | (c->diff_filtered_ns > 0 ? 0x80000000u : 0));
	put_le16(esc->reg + ESC_REG_DC_SPEED_COUNTER_DIFF, (uint16_t)(int16_t)d);
}
