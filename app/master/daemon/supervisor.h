/* SPDX-License-Identifier: MIT */
/*
 * A thread that checks whether the control program returns, while the cycle runs. It shares
 * nothing with the service thread, which may be waiting for the cycle itself.
 */
#ifndef DAEMON_SUPERVISOR_H
#define DAEMON_SUPERVISOR_H

#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>

struct control;

struct supervisor_spec {
	struct control *control; /* NULL: nothing to supervise */
	int64_t limit_ns;
	/* Inside one call for longer than the limit. Context: the supervisor's thread. */
	void (*stuck)(void *ctx, int64_t busy_ns);
	void *ctx;
};

struct supervisor {
	struct supervisor_spec spec;
	int is_running;
	sem_t end;
	pthread_t thread;
};

/** 0 or -errno. Context: service thread. */
int supervisor_start(struct supervisor *supervisor, const struct supervisor_spec *spec);
/** Also if it was not started. Context: service thread, after the cycle has ended. */
void supervisor_stop(struct supervisor *supervisor);

#endif
