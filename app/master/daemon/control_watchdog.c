/* SPDX-License-Identifier: MIT */
#include "daemon/control_watchdog.h"

#include <errno.h>
#include <signal.h>
#include <time.h>

#include "base/platform.h"
#include "control/program.h"

/* Checks per limit. */
enum { LOOKS = 8 };

static struct timespec timespec_of(mono_t t)
{
	return (struct timespec){ .tv_sec = t.ns / NS_PER_S, .tv_nsec = t.ns % NS_PER_S };
}

static void *look_after(void *arg)
{
	struct control_watchdog *wd = arg;
	const struct platform pf = platform_posix();

	for (;;) {
		struct timespec until;
		int64_t busy_ns;

		until = timespec_of(
			mono_add(pf.now(pf.ctx), (span_t){ wd->spec.limit_ns / LOOKS }));
		if (sem_clockwait(&wd->end, CLOCK_MONOTONIC, &until) == 0) {
			return NULL;
		}
		busy_ns = control_busy_ns(wd->spec.control, pf.now(pf.ctx));
		if (busy_ns > wd->spec.limit_ns) {
			wd->spec.stuck(wd->spec.ctx, busy_ns);
		}
	}
}

int control_watchdog_start(struct control_watchdog *watchdog,
			   const struct control_watchdog_spec *spec)
{
	sigset_t all;
	sigset_t old;
	int r;

	watchdog->spec = *spec;
	watchdog->is_running = 0;
	if (spec->control == NULL) {
		return 0;
	}
	sem_init(&watchdog->end, 0, 0);
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &old);
	r = pthread_create(&watchdog->thread, NULL, look_after, watchdog);
	pthread_sigmask(SIG_SETMASK, &old, NULL);
	if (r != 0) {
		sem_destroy(&watchdog->end);
		return -r;
	}
	pthread_setname_np(watchdog->thread, "ecdaqd-watchdog");
	watchdog->is_running = 1;
	return 0;
}

void control_watchdog_stop(struct control_watchdog *watchdog)
{
	if (!watchdog->is_running) {
		return;
	}
	sem_post(&watchdog->end);
	pthread_join(watchdog->thread, NULL);
	sem_destroy(&watchdog->end);
	watchdog->is_running = 0;
}
