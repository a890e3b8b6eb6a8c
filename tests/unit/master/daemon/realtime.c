/* SPDX-License-Identifier: MIT */
#include "daemon/realtime.h"

#include "harness/test.h"

TEST(daemon_realtime, no_core_is_not_isolated)
{
	CHECK_EQ(realtime_is_isolated(-1), 0);
}

struct heard {
	uint32_t which;
	unsigned count;
	char text[320];
};

static void hear(void *ctx, enum event_rt which, int err, const char *text)
{
	struct heard *heard = ctx;

	(void)err;
	heard->which |= 1u << which;
	heard->count++;
	snprintf(heard->text, sizeof(heard->text), "%s", text);
}

TEST(daemon_realtime, what_was_not_requested_is_not_reported)
{
	static struct config cfg;
	struct realtime rt;
	struct heard heard = { 0 };

	config_defaults(&cfg);
	cfg.cycle_cpu_dma_latency_us = -1;
	realtime_open(&rt, &cfg, hear, &heard);
	CHECK_EQ(rt.dma_latency, -1);
	realtime_close(&rt);
	CHECK_EQ(heard.count, 0);
}
