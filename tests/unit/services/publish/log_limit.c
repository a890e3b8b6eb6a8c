/* SPDX-License-Identifier: MIT */
#include "publish/log_limit.h"

#include "harness/test.h"

TEST(log_limit, a_flood_is_a_burst_and_then_a_line_in_10_s_with_the_count_of_the_others)
{
	struct log_limit limit = { .used = 0 };
	int64_t now_ns = 5 * NS_PER_S;
	uint64_t counted = 0;
	unsigned lines = 0;
	unsigned sent = 0;

	for (unsigned ms = 0; ms < 600000; ms++, now_ns += NS_PER_MS) {
		uint64_t count = log_limit_take_count(&limit, now_ns);

		counted += count;
		lines += count > 0;
		lines += (unsigned)log_limit_take(&limit, now_ns);
		sent++;
	}
	CHECK_EQ(lines, LOG_LIMIT_BURST + 59);
	/* Each line that was not written is in a count, told or still to be told. */
	CHECK_EQ(counted + limit.suppressed, sent - LOG_LIMIT_BURST);
	CHECK(limit.suppressed > 0);
	now_ns += LOG_LIMIT_REFILL_NS;
	counted += log_limit_take_count(&limit, now_ns);
	CHECK_EQ(counted, sent - LOG_LIMIT_BURST);
	CHECK_EQ(log_limit_take_count(&limit, now_ns), 0);
}

TEST(log_limit, after_silence_there_is_a_whole_burst_again)
{
	struct log_limit limit = { .used = 0 };
	int64_t now_ns = 0;

	for (unsigned round = 0; round < 3; round++, now_ns += 1000 * NS_PER_S) {
		unsigned lines = 0;

		for (unsigned i = 0; i < 2 * LOG_LIMIT_BURST; i++) {
			lines += (unsigned)log_limit_take(&limit, now_ns);
		}
		CHECK_EQ(lines, LOG_LIMIT_BURST);
		now_ns += 1000 * NS_PER_S;
		CHECK_EQ(log_limit_take_count(&limit, now_ns), LOG_LIMIT_BURST);
	}
}

TEST(log_limit, a_line_now_and_then_is_always_written)
{
	struct log_limit limit = { .used = 0 };

	for (int64_t n = 0; n < 100; n++) {
		CHECK(log_limit_take(&limit, n * LOG_LIMIT_REFILL_NS));
	}
	CHECK_EQ(log_limit_take_count(&limit, 100 * LOG_LIMIT_REFILL_NS), 0);
}
