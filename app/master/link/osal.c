/* SPDX-License-Identifier: MIT */
/*
 * Time for SOEM: the clock and the sleep of the line that is bound to this thread, real or virtual.
 * Without a line, the machine's own. Threads are not offered: SOEM's functions start none.
 */
#include "osal.h"

#include "base/platform.h"
#include "link/line.h"

static struct platform bound_platform(void)
{
	const struct line *line = line_bound();

	return line == NULL ? platform_posix() : *line_platform(line);
}

static ec_timet to_timet(int64_t ns)
{
	return (ec_timet){
		.sec = (uint32)(ns / NS_PER_S),
		.usec = (uint32)(ns % NS_PER_S / NS_PER_US),
	};
}

static mono_t monotonic(void)
{
	struct platform platform = bound_platform();

	return platform.now(platform.ctx);
}

void osal_timer_start(osal_timert *self, uint32 timeout_us)
{
	self->stop_time = to_timet(monotonic().ns + (int64_t)timeout_us * NS_PER_US);
}

/* SOEM repeats until a timer has expired: a cancelled line ends that at once. */
boolean osal_timer_is_expired(osal_timert *self)
{
	ec_timet now = to_timet(monotonic().ns);

	if (line_bound() != NULL && line_is_cancelled(line_bound())) {
		return TRUE;
	}
	if (now.sec != self->stop_time.sec) {
		return now.sec > self->stop_time.sec;
	}
	return now.usec >= self->stop_time.usec;
}

int osal_usleep(uint32 usec)
{
	struct line *line = line_bound();
	struct platform platform;

	if (line != NULL) {
		line_sleep(line, (span_t){ (int64_t)usec * NS_PER_US });
		return 0;
	}
	platform = platform_posix();
	return platform.sleep_until(platform.ctx, (mono_t){ platform.now(platform.ctx).ns +
							    (int64_t)usec * NS_PER_US });
}

/* SOEM stamps its error list with it, and nothing else that ecdaq uses. */
ec_timet osal_current_time(void)
{
	struct platform platform = bound_platform();

	return to_timet(platform.tai_ns(platform.ctx));
}

void osal_time_diff(ec_timet *start, ec_timet *end, ec_timet *diff)
{
	int64_t from_us = (int64_t)start->sec * 1000000 + start->usec;
	int64_t to_us = (int64_t)end->sec * 1000000 + end->usec;

	*diff = to_timet((to_us - from_us) * NS_PER_US);
}
