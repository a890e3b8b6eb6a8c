/* SPDX-License-Identifier: MIT */
/*
 * The ESC's clock, in integers, so that a run is the same on every machine: rates are relative
 * deviations in units of 2^-48 (3.6e-15), the local time has 48 bits behind the ns. What registers
 * and the SYNC unit see is its tick of 10 ns.
 */
#include "segment/esc_internal.h"

enum { RATE_BITS = 48, TICK_NS = 10 };

#define RATE_ONE ((__int128)1 << RATE_BITS)

/* What the rate made of @dt_ns: whole ns, and the rest in 2^-48 ns. */
static int64_t deviation(const struct esc_clock *c, int64_t dt_ns, uint64_t *ret_fraction)
{
	__int128 d = (__int128)dt_ns * c->rate + (__int128)c->base_fraction;

	*ret_fraction = (uint64_t)(d & (RATE_ONE - 1));
	return (int64_t)(d >> RATE_BITS);
}

uint64_t esc_local_time(const struct esc *esc, int64_t t_ns)
{
	const struct esc_clock *c = &esc->clock;
	int64_t dt = t_ns - c->base_true_ns;
	uint64_t fraction;
	uint64_t local = c->base_local_ns + (uint64_t)(dt + deviation(c, dt, &fraction));

	return local - (local - c->phase_ns) % TICK_NS;
}

static uint64_t system_of(const struct esc *esc, uint64_t local_ns)
{
	uint64_t s = local_ns + esc->clock.offset_ns;

	return esc->features.dc == ESC_DC_32 ? s & UINT32_MAX : s;
}

uint64_t esc_system_time(const struct esc *esc, int64_t t_ns)
{
	return system_of(esc, esc_local_time(esc, t_ns));
}

/*
 * How long it takes to pass @left of 2^-48 ns, rounded up to whole ns of true time: by steps that
 * each leave the rate's part of the error, since a division of 128 bits takes longer.
 */
static int64_t when_passed(const struct esc_clock *c, __int128 left)
{
	__int128 speed = RATE_ONE + c->rate;
	int64_t dt = (int64_t)(left >> RATE_BITS);
	__int128 over = (__int128)dt * c->rate - (left & (RATE_ONE - 1)); /* dt * speed - left */
	int64_t step;

	do {
		step = (int64_t)(-over >> RATE_BITS);
		dt += step;
		over += step * speed;
	} while (step > 1 || step < -1);
	for (; over < 0; over += speed) {
		dt++;
	}
	for (; over >= speed; over -= speed) {
		dt--;
	}
	return dt;
}

/* First true time at which the tick is at or past @local_ns. */
static int64_t when_local(const struct esc_clock *c, uint64_t local_ns)
{
	uint64_t past = (local_ns - c->phase_ns) % TICK_NS;
	uint64_t tick = past == 0 ? local_ns : local_ns + (TICK_NS - past);
	__int128 left = ((__int128)(int64_t)(tick - c->base_local_ns) << RATE_BITS) -
			(__int128)c->base_fraction;
	return c->base_true_ns + when_passed(c, left);
}

int64_t esc_clock_when(const struct esc *esc, int64_t t_ns, uint64_t system_ns)
{
	uint64_t local = esc_local_time(esc, t_ns);
	uint64_t left = system_ns - system_of(esc, local);
	int64_t at_ns;

	/* The tick that is on now has not passed. */
	if (left > UINT64_MAX - TICK_NS) {
		return t_ns;
	}
	/* With 32 bits a time that is past comes again; with 64 it never does. */
	if (esc->features.dc == ESC_DC_32) {
		left = left & UINT32_MAX;
		left = left > UINT32_MAX - TICK_NS ? 0 : left;
	}
	if (left > INT64_MAX / 4) {
		return INT64_MAX;
	}
	at_ns = when_local(&esc->clock, local + left);
	return at_ns > t_ns ? at_ns : t_ns;
}

static void rebase(struct esc_clock *c, int64_t t_ns)
{
	int64_t dt = t_ns - c->base_true_ns;
	uint64_t fraction;

	c->base_local_ns += (uint64_t)(dt + deviation(c, dt, &fraction));
	c->base_fraction = fraction;
	c->base_true_ns = t_ns;
}

/* Crystal and correction together: (1 + a) (1 + b) - 1. */
static void combine(struct esc_clock *c)
{
	c->rate = c->crystal + c->correction +
		  (int64_t)(((__int128)c->crystal * c->correction) >> RATE_BITS);
}

static int64_t rate_of_ppm(double ppm)
{
	return (int64_t)(ppm * 1e-6 * 0x1p48);
}

void esc_clock_start(struct esc *esc, int64_t t_ns, uint64_t local_ns, double ppm)
{
	esc->clock = (struct esc_clock){ .crystal = rate_of_ppm(ppm),
					 .base_true_ns = t_ns,
					 .base_local_ns = local_ns,
					 .phase_ns = local_ns % TICK_NS };
	esc_dc_reset_filter(esc, t_ns);
}

void esc_clock_drift(struct esc *esc, int64_t t_ns, double ppm)
{
	rebase(&esc->clock, t_ns);
	esc->clock.crystal = rate_of_ppm(ppm);
	combine(&esc->clock);
	esc_sync_replan(esc, t_ns);
}

void esc_clock_correct(struct esc *esc, int64_t t_ns, int64_t correction)
{
	rebase(&esc->clock, t_ns);
	esc->clock.correction = correction;
	combine(&esc->clock);
	esc_sync_replan(esc, t_ns);
}
