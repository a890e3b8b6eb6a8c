/* SPDX-License-Identifier: MIT */
#include "platform.h"

#include <errno.h>
#include <sys/timex.h>
#include <time.h>

static int64_t read_clock(clockid_t id)
{
	struct timespec ts;

	clock_gettime(id, &ts);
	return ts.tv_sec * NS_PER_S + ts.tv_nsec;
}

static mono_t posix_now(void *ctx)
{
	(void)ctx;
	return (mono_t){ read_clock(CLOCK_MONOTONIC) };
}

static int64_t posix_tai(void *ctx)
{
	(void)ctx;
	return read_clock(CLOCK_TAI);
}

static int posix_sleep_until(void *ctx, mono_t deadline)
{
	struct timespec ts = { .tv_sec = deadline.ns / NS_PER_S,
			       .tv_nsec = deadline.ns % NS_PER_S };
	int r;

	(void)ctx;
	do {
		r = clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &ts, NULL);
	} while (r == EINTR);
	return -r;
}

static int posix_clock_quality(void *ctx, struct clock_quality *ret)
{
	struct timex tx = { .modes = 0 };

	(void)ctx;
	if (adjtimex(&tx) < 0) {
		return -errno;
	}
	*ret = (struct clock_quality){ .is_disciplined = (tx.status & STA_UNSYNC) == 0,
				       .error_ns = (int64_t)tx.maxerror * 1000,
				       .estimate_ns = (int64_t)tx.esterror * 1000,
				       .tai_offset_s = tx.tai };
	return 0;
}

struct platform platform_posix(void)
{
	return (struct platform){
		.now = posix_now,
		.tai_ns = posix_tai,
		.sleep_until = posix_sleep_until,
		.clock_quality = posix_clock_quality,
		.ctx = NULL,
	};
}

int platform_tai_offset_s(int32_t *ret_offset_s)
{
	struct clock_quality quality = { .tai_offset_s = 0 };
	int r = posix_clock_quality(NULL, &quality);

	if (r == 0) {
		*ret_offset_s = quality.tai_offset_s;
	}
	return r;
}
