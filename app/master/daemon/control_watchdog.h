/* SPDX-License-Identifier: MIT */
/*
 * The watchdog of the control program: a thread that checks whether cycle() returns, while the
 * cycle runs. It shares nothing with the service thread, which may be waiting for the cycle itself.
 */
#ifndef DAEMON_CONTROL_WATCHDOG_H
#define DAEMON_CONTROL_WATCHDOG_H

#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>

struct control;

struct control_watchdog_spec {
	struct control *control; /* NULL: nothing to watch */
	int64_t limit_ns;
	/* Inside one call for longer than the limit. Context: its thread. */
	void (*stuck)(void *ctx, int64_t busy_ns);
	void *ctx;
};

struct control_watchdog {
	struct control_watchdog_spec spec;
	int is_running;
	sem_t end;
	pthread_t thread;
};

/** 0 or -errno. Context: service thread. */
int control_watchdog_start(struct control_watchdog *watchdog,
			   const struct control_watchdog_spec *spec);
/** Also if it was not started. Context: service thread, after the cycle has ended. */
void control_watchdog_stop(struct control_watchdog *watchdog);

#endif
