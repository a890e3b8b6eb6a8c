/* SPDX-License-Identifier: MIT */
/* The thread of ecdaqd that notices a call of the control program that does not return. */
#include "daemon/control_watchdog.h"

#include <semaphore.h>

#include "unit/master/control/bench.h"

#define LIMIT_NS (8 * NS_PER_MS)

static sem_t noticed;
static int64_t noticed_ns;
static unsigned notices;

static void on_stuck(void *ctx, int64_t busy_ns)
{
	CHECK(ctx == &noticed);
	if (notices++ == 0) {
		noticed_ns = busy_ns;
		sem_post(&noticed);
	}
}

/* Returns when the watchdog has noticed it: the test would not end otherwise. */
static int wait_for_notice(const struct ecdaq_cycle *cy, void *state)
{
	(void)cy;
	(void)state;
	while (sem_wait(&noticed) != 0) {
	}
	return ECDAQ_GO_ON;
}

static void begin(int (*cycle)(const struct ecdaq_cycle *cy, void *state))
{
	const struct platform pf = platform_posix();

	sem_init(&noticed, 0, 0);
	notices = 0;
	bench_configure()->cycle = cycle;
	CHECK_EQ(bench_begin(), 0);
	bench.now_ns = pf.now(pf.ctx).ns;
}

TEST(control, the_watchdog_notices_a_call_that_does_not_return)
{
	struct control_watchdog watchdog;
	struct control_watchdog_spec spec = { .limit_ns = LIMIT_NS,
					      .stuck = on_stuck,
					      .ctx = &noticed };

	begin(wait_for_notice);
	spec.control = bench.control;
	CHECK_EQ(control_watchdog_start(&watchdog, &spec), 0);
	bench_run();
	control_watchdog_stop(&watchdog);
	CHECK(notices >= 1);
	CHECK(noticed_ns > LIMIT_NS);
	bench_done();
	sem_destroy(&noticed);
}

TEST(control, a_watchdog_without_a_program_is_no_thread)
{
	const struct control_watchdog_spec spec = { .limit_ns = LIMIT_NS, .stuck = on_stuck };
	struct control_watchdog watchdog;

	CHECK_EQ(control_watchdog_start(&watchdog, &spec), 0);
	CHECK_EQ(watchdog.is_running, 0);
	control_watchdog_stop(&watchdog);
}
