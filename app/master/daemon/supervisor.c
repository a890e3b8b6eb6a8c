/* SPDX-License-Identifier: MIT */
#include "daemon/supervisor.h"

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
	struct supervisor *sv = arg;
	const struct platform pf = platform_posix();

	for (;;) {
		struct timespec until;
		int64_t busy_ns;

		until = timespec_of(
			mono_add(pf.now(pf.ctx), (span_t){ sv->spec.limit_ns / LOOKS }));
		if (sem_clockwait(&sv->end, CLOCK_MONOTONIC, &until) == 0) {
			return NULL;
		}
		busy_ns = control_busy_ns(sv->spec.control, pf.now(pf.ctx));
		if (busy_ns > sv->spec.limit_ns) {
			sv->spec.stuck(sv->spec.ctx, busy_ns);
		}
	}
}

int supervisor_start(struct supervisor *supervisor, const struct supervisor_spec *spec)
{
	sigset_t all;
	sigset_t old;
	int r;

	supervisor->spec = *spec;
	supervisor->is_running = 0;
	if (spec->control == NULL) {
		return 0;
	}
	sem_init(&supervisor->end, 0, 0);
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &old);
	r = pthread_create(&supervisor->thread, NULL, look_after, supervisor);
	pthread_sigmask(SIG_SETMASK, &old, NULL);
	if (r != 0) {
		sem_destroy(&supervisor->end);
		return -r;
	}
	pthread_setname_np(supervisor->thread, "ecdaqd-super");
	supervisor->is_running = 1;
	return 0;
}

void supervisor_stop(struct supervisor *supervisor)
{
	if (!supervisor->is_running) {
		return;
	}
	sem_post(&supervisor->end);
	pthread_join(supervisor->thread, NULL);
	sem_destroy(&supervisor->end);
	supervisor->is_running = 0;
}
