/* SPDX-License-Identifier: MIT */
/*
 * The time loop control: each write to 0x0910 compares the local copy of the system time with the
 * time received and regulates the local clock. From the data sheet: the registers, their resets,
 * and the rate that a speed counter difference D stands for, D / (5 (S + D + 2) (S - D + 2)) with S
 * = 0x0930. How D follows the difference is not published; ours is a second order loop, critically
 * damped, whose bandwidth goes with the rate of the frames (simulated-esc.md, "Time loop control").
 */
#include <math.h>

#include "segment/esc_internal.h"

#define LOOP_GAIN (1.0 / 48.0) /* natural frequency times the interval of the frames */
#define INTERVAL_MIN_NS 5e3
#define INTERVAL_MAX_NS 2e7
#define INTERVAL_START_NS 1e6
#define INTERVAL_SHARE (1.0 / 8.0)

enum { SPEED_MARGIN = 0x7f, SPEED_FILTER_NOMINAL = 12, RATE_SCALE_BITS = 48 };

/* Neither is ever no number; fmin() and fmax() are calls. */
static double lesser(double a, double b)
{
	return a < b ? a : b;
}

static double greater(double a, double b)
{
	return a > b ? a : b;
}

static int64_t speed_limit(const struct esc_clock *c)
{
	return c->speed_start > SPEED_MARGIN ? c->speed_start - SPEED_MARGIN : 0;
}

/* What D does to the clock, in 2^-48. */
static int64_t rate_of_speed(const struct esc_clock *c, int64_t d)
{
	int64_t s = (int64_t)c->speed_start + 2;
	int64_t divisor = 5 * (s + d) * (s - d);

	return d * ((int64_t)1 << RATE_SCALE_BITS) / divisor; /* |d| < 2^15 */
}

/* The D whose rate is nearest to @wanted: the positive root of 5 w D^2 + D - 5 w S^2 = 0. */
static int64_t speed_of_rate(const struct esc_clock *c, double wanted)
{
	double s = (double)c->speed_start + 2.0;
	double k = 5.0 * fabs(wanted);
	double limit = (double)speed_limit(c);
	double d = k < 1e-12 ? 0.0 : (-1.0 + sqrt(1.0 + 4.0 * k * k * s * s)) / (2.0 * k);

	d = lesser(floor(d + 0.5), limit);
	return (int64_t)copysign(d, wanted);
}

/* A filtered difference must not lag behind what the loop does with it. */
static double loop_gain(const struct esc_clock *c)
{
	return lesser(LOOP_GAIN, 1.0 / (3.0 * (double)(1u << c->time_filter)));
}

void esc_dc_reset_filter(struct esc *esc, int64_t t_ns)
{
	struct esc_clock *c = &esc->clock;

	c->time_filter = esc->reg[ESC_REG_DC_TIME_FILTER] & 0x0f;
	c->speed_filter = esc->reg[ESC_REG_DC_SPEED_FILTER] & 0x0f;
	c->speed_start = get_le16(esc->reg + ESC_REG_DC_SPEED_COUNTER_START) & 0x7fff;
	c->loop_gain = loop_gain(c);
	c->rate_limit = (double)rate_of_speed(c, speed_limit(c)) * 0x1p-48;
	c->diff_filtered_ns = 0;
	c->integral = 0;
	c->interval_ns = INTERVAL_START_NS;
	c->has_compared = 0;
	c->speed_diff = 0;
	esc_clock_correct(esc, t_ns, 0);
}

static void regulate(struct esc *esc, int64_t t_ns, double behind_ns)
{
	struct esc_clock *c = &esc->clock;
	double gain = c->loop_gain;
	double slower = c->speed_filter > SPEED_FILTER_NOMINAL
				? 1.0 / (double)(1u << (c->speed_filter - SPEED_FILTER_NOMINAL))
				: 1.0;
	double limit = c->rate_limit;
	double proportional = 2.0 * gain * behind_ns / c->interval_ns;
	int64_t speed_diff;

	/* Driven to its limit it learns nothing about the crystals. */
	if (fabs(proportional) < limit) {
		c->integral += gain * gain * slower * behind_ns / c->interval_ns;
		c->integral = greater(-limit, lesser(limit, c->integral));
	}
	speed_diff = speed_of_rate(c, c->integral + proportional);
	if (speed_diff != c->speed_diff) {
		c->speed_diff = speed_diff;
		esc_clock_correct(esc, t_ns, rate_of_speed(c, speed_diff));
	}
}

void esc_dc_compare(struct esc *esc, int64_t t_ns, uint64_t received_ns)
{
	struct esc_clock *c = &esc->clock;
	uint64_t delay = get_le32(esc->reg + ESC_REG_DC_SYSTEM_TIME_DELAY);
	uint64_t local = esc_local_time(esc, t_ns);
	int64_t behind_ns = (int64_t)(received_ns + delay - (local + c->offset_ns));
	double since_ns = (double)(int64_t)(local - c->last_compare_ns);

	if (esc->features.dc == ESC_DC_32) {
		behind_ns = (int32_t)(uint32_t)behind_ns;
	}
	c->diff_filtered_ns +=
		((double)behind_ns - c->diff_filtered_ns) / (double)(1u << c->time_filter);
	/* More than one comparison in a frame adds no information. */
	if (c->has_compared && since_ns <= 0) {
		return;
	}
	if (c->has_compared) {
		since_ns = greater(INTERVAL_MIN_NS, lesser(INTERVAL_MAX_NS, since_ns));
		c->interval_ns += (since_ns - c->interval_ns) * INTERVAL_SHARE;
		c->interval_ns = greater(c->interval_ns, since_ns);
		regulate(esc, t_ns, c->diff_filtered_ns);
	}
	c->has_compared = 1;
	c->last_compare_ns = local;
}

void esc_dc_to_registers(struct esc *esc)
{
	const struct esc_clock *c = &esc->clock;
	double magnitude = lesser(floor(fabs(c->diff_filtered_ns) + 0.5), (double)INT32_MAX);

	/* Bit 31: the local copy is smaller than the time received (data sheet, section II). */
	put_le32(esc->reg + ESC_REG_DC_SYSTEM_TIME_DIFF,
		 (uint32_t)magnitude |
			 (magnitude > 0 && c->diff_filtered_ns > 0 ? UINT32_C(0x80000000) : 0));
	put_le16(esc->reg + ESC_REG_DC_SPEED_COUNTER_DIFF, (uint16_t)(int16_t)c->speed_diff);
}
