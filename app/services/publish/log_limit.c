/* SPDX-License-Identifier: MIT */
#include "publish/log_limit.h"

static void refill(struct log_limit *limit, int64_t now_ns)
{
	int64_t lines = (now_ns - limit->refilled_ns) / LOG_LIMIT_REFILL_NS;

	if (limit->used == 0 || lines >= limit->used) {
		limit->used = 0;
		limit->refilled_ns = now_ns;
	} else if (lines > 0) {
		limit->used -= (unsigned)lines;
		limit->refilled_ns += lines * LOG_LIMIT_REFILL_NS;
	}
}

int log_limit_take(struct log_limit *limit, int64_t now_ns)
{
	refill(limit, now_ns);
	if (limit->used == LOG_LIMIT_BURST) {
		limit->suppressed++;
		return 0;
	}
	limit->used++;
	return 1;
}

uint64_t log_limit_take_count(struct log_limit *limit, int64_t now_ns)
{
	uint64_t count = limit->suppressed;

	refill(limit, now_ns);
	if (count == 0 || limit->used == LOG_LIMIT_BURST) {
		return 0;
	}
	limit->used++;
	limit->suppressed = 0;
	return count;
}
