/* SPDX-License-Identifier: MIT */
/*
 * Time as types. mono_t is an instant of CLOCK_MONOTONIC (or of the virtual clock), dc_t an instant
 * of EtherCAT system time (ns since 2000-01-01, scale as set by the master), span_t a difference.
 * Context: any, RT-safe.
 */
#ifndef BASE_CLOCK_H
#define BASE_CLOCK_H

#include <stdint.h>

#define NS_PER_S INT64_C(1000000000)
#define NS_PER_MS INT64_C(1000000)
#define NS_PER_US INT64_C(1000)
/* 2000-01-01T00:00:00Z in Unix time. */
#define DC_EPOCH_UNIX_S INT64_C(946684800)

typedef struct {
	int64_t ns;
} mono_t;

typedef struct {
	int64_t ns;
} span_t;

static inline span_t mono_sub(mono_t a, mono_t b)
{
	return (span_t){ a.ns - b.ns };
}

static inline mono_t mono_add(mono_t t, span_t d)
{
	return (mono_t){ t.ns + d.ns };
}

/** The remainder of @a divided by @m (> 0), always in [0, m). */
static inline int64_t mod_floor(int64_t a, int64_t m)
{
	int64_t r = a % m;

	return r < 0 ? r + m : r;
}

/** @error folded into [-period/2, period/2), so that the shorter way round is taken (T21). */
static inline int64_t fold_ns(int64_t error_ns, int64_t period_ns)
{
	return mod_floor(error_ns + period_ns / 2, period_ns) - period_ns / 2;
}

#endif
