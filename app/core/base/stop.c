/* SPDX-License-Identifier: MIT */
#include "base/stop.h"

#include <poll.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/host_clock.h"

enum { EXIT_OF_SIGNAL = 128 };

static volatile sig_atomic_t is_requested;
static int64_t requested_at_ns; /* of the handler alone, which does not interrupt itself */
static int64_t grace_of_first_ns;
static void (*on_first)(void);
static sigset_t outside; /* the mask while waiting */

static void on_signal(int number)
{
	if (is_requested && host_clock_ns(CLOCK_MONOTONIC) - requested_at_ns >= grace_of_first_ns) {
		_exit(EXIT_OF_SIGNAL + number);
	}
	if (!is_requested) {
		requested_at_ns = host_clock_ns(CLOCK_MONOTONIC);
		if (on_first != NULL) {
			on_first();
		}
	}
	is_requested = 1;
}

void stop_catch(int64_t grace_ns, void (*notify)(void))
{
	struct sigaction action = { .sa_handler = on_signal };

	grace_of_first_ns = grace_ns;
	on_first = notify;
	sigprocmask(SIG_SETMASK, NULL, &outside);
	sigaddset(&action.sa_mask, SIGTERM);
	sigaddset(&action.sa_mask, SIGINT);
	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGINT, &action, NULL);
}

void stop_block(void)
{
	sigset_t stops;

	sigemptyset(&stops);
	sigaddset(&stops, SIGTERM);
	sigaddset(&stops, SIGINT);
	sigprocmask(SIG_BLOCK, &stops, &outside);
}

int stop_requested(void)
{
	return is_requested;
}

const volatile sig_atomic_t *stop_flag(void)
{
	return &is_requested;
}

void stop_wait(int64_t wait_ns)
{
	struct timespec wait = { .tv_sec = (time_t)(wait_ns / NS_PER_S),
				 .tv_nsec = (long)(wait_ns % NS_PER_S) };

	ppoll(NULL, 0, &wait, &outside);
}
