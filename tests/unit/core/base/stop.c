/* SPDX-License-Identifier: MIT */
#include "base/stop.h"

#include <sys/wait.h>
#include <unistd.h>

#include "harness/test.h"

static volatile sig_atomic_t notified;

static void notify(void)
{
	notified++;
}

/* Run @body in a process of its own, for what is caught stays caught. Its exit code. */
static int exit_code_of(void (*body)(void))
{
	int status;
	pid_t child = fork();

	CHECK(child >= 0);
	if (child == 0) {
		body();
		_exit(0);
	}
	CHECK_EQ(waitpid(child, &status, 0), child);
	CHECK(WIFEXITED(status));
	return WEXITSTATUS(status);
}

static void two_signals_ignored(void)
{
	stop_catch(STOP_REPEAT_IGNORED, notify);
	CHECK_EQ(stop_requested(), 0);
	raise(SIGTERM);
	CHECK_EQ(stop_requested(), 1);
	CHECK_EQ(*stop_flag(), 1);
	raise(SIGINT);
	CHECK_EQ(stop_requested(), 1);
	CHECK_EQ(notified, 1);
}

TEST(stop, a_signal_is_kept_and_notified_once)
{
	CHECK_EQ(exit_code_of(two_signals_ignored), 0);
}

static void two_signals(void)
{
	stop_catch(0, NULL);
	raise(SIGTERM);
	raise(SIGINT);
}

TEST(stop, a_second_signal_exits_after_the_grace)
{
	CHECK_EQ(exit_code_of(two_signals), 128 + SIGINT);
}

static void two_signals_in_a_minute(void)
{
	stop_catch(INT64_C(60) * 1000000000, notify);
	raise(SIGTERM);
	raise(SIGTERM);
	raise(SIGINT);
	CHECK_EQ(notified, 1);
}

TEST(stop, a_second_signal_in_the_grace_leaves_the_stop_to_finish)
{
	CHECK_EQ(exit_code_of(two_signals_in_a_minute), 0);
}

static void wait_for_a_blocked_one(void)
{
	stop_catch(STOP_REPEAT_IGNORED, NULL);
	stop_block();
	raise(SIGTERM);
	CHECK_EQ(stop_requested(), 0);
	stop_wait(INT64_C(3600) * 1000000000);
	CHECK_EQ(stop_requested(), 1);
}

TEST(stop, a_blocked_signal_ends_the_wait_that_follows)
{
	CHECK_EQ(exit_code_of(wait_for_a_blocked_one), 0);
}
