/* SPDX-License-Identifier: MIT */
/* The clocks of this machine, for programs beside the master, which has base/platform.h. Context:
 * any, RT-safe. */
#ifndef BASE_HOST_CLOCK_H
#define BASE_HOST_CLOCK_H

#include <stdint.h>
#include <time.h>

#include "clock.h"

/** @clock, such as CLOCK_MONOTONIC, in ns. */
static inline int64_t host_clock_ns(clockid_t clock)
{
	struct timespec ts;

	clock_gettime(clock, &ts);
	return (int64_t)ts.tv_sec * NS_PER_S + ts.tv_nsec;
}

#endif
