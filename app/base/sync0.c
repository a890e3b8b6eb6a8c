/* SPDX-License-Identifier: MIT */
#include "sync0.h"

#include <stddef.h>

static const char *pick(const char *const *names, size_t count, uint32_t n)
{
	return n < count ? names[n] : "unknown";
}

#define PICK(names, n) pick(names, sizeof(names) / sizeof((names)[0]), n)

const char *sync0_source_to_str(uint32_t source)
{
	static const char *const names[] = {
		[SYNC0_GPIO] = "gpio",
		[SYNC0_SIMULATED] = "simulated edges",
		[SYNC0_RECORDED] = "recorded edges",
	};

	return PICK(names, source);
}

const char *sync0_verdict_to_str(uint32_t verdict)
{
	static const char *const names[] = {
		[SYNC0_NONE] = "-",    [SYNC0_OK] = "OK",     [SYNC0_UNRESOLVED] = "UNRESOLVED",
		[SYNC0_WARN] = "WARN", [SYNC0_FAIL] = "FAIL",
	};

	return PICK(names, verdict);
}

const char *sync0_check_to_str(uint32_t check)
{
	static const char *const names[] = {
		[SYNC0_CHECK_COUNT] = "count",   [SYNC0_CHECK_PERIOD] = "period",
		[SYNC0_CHECK_JITTER] = "jitter", [SYNC0_CHECK_PHASE] = "phase",
		[SYNC0_CHECK_SKEW] = "skew",
	};

	return PICK(names, check);
}

const char *sync0_state_to_str(uint32_t state)
{
	static const char *const names[] = {
		[SYNC0_WAITING] = "waiting for ecdaqd",
		[SYNC0_NO_LINE] = "no line",
		[SYNC0_NO_DC] = "no distributed clocks",
		[SYNC0_LEARNING] = "first window not full yet",
		[SYNC0_RUNNING] = "running",
		[SYNC0_ENDED] = "ended",
	};

	return PICK(names, state);
}
