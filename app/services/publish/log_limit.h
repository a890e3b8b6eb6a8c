/* SPDX-License-Identifier: MIT */
/*
 * Bounds what others can make us write to the log: LOG_LIMIT_BURST lines at once, then one in
 * LOG_LIMIT_REFILL_NS; those left out are counted. Context: any thread, one at a time.
 */
#ifndef PUBLISH_LOG_LIMIT_H
#define PUBLISH_LOG_LIMIT_H

#include <stdint.h>

#include "base/clock.h"

#define LOG_LIMIT_BURST 20
#define LOG_LIMIT_REFILL_NS (10 * NS_PER_S)

struct log_limit {
	unsigned used;       /* lines of the burst that are not refilled yet */
	int64_t refilled_ns; /* when the newest one was */
	uint64_t suppressed; /* lines left out that nobody was told of yet */
};

/** 1 if a line may be written now (monotonic @now_ns); 0: it is counted as suppressed. */
int log_limit_take(struct log_limit *limit, int64_t now_ns);

/** Lines suppressed since the last time that this was not 0; always 0 while a line would be
 * suppressed, so that the count is a line in place of another. */
uint64_t log_limit_take_count(struct log_limit *limit, int64_t now_ns);

#endif
