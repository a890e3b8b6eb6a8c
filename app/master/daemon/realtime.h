/* SPDX-License-Identifier: MIT */
/*
 * Real-time resources of the cycle: a thread of its own with a prefaulted stack, a SCHED_FIFO
 * priority, a core, locked memory, no deep CPU sleep. Each is set in the configuration; each that
 * is not available is reported once, with the remedy, and the cycle runs without it. Context:
 * service thread.
 */
#ifndef DAEMON_REALTIME_H
#define DAEMON_REALTIME_H

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>

#include "base/event.h"
#include "config/config.h"
#include "cycle/cycle.h"
#include "daemon/failure.h"

/* @text: what was requested, why it was refused and the remedy, on one line. */
typedef void realtime_degraded_fn(void *ctx, enum event_rt which, int err, const char *text);

struct realtime {
	const struct config *cfg;
	realtime_degraded_fn *degraded;
	void *ctx;
	uint32_t reported; /* bit per enum event_rt */
	int dma_latency;   /* descriptor held open; -1: none */
	int is_pinned;
	void *stack;
	pthread_t thread;
	int is_running;
	struct cycle *cycle;
	sem_t gate;
	int result;            /* [cycle] of cycle_run(); read after join */
	_Atomic int has_ended; /* [cycle] */
};

/** @cfg outlives it. CPU sleep and the service thread's own affinity are set here. */
void realtime_open(struct realtime *rt, const struct config *cfg, realtime_degraded_fn *degraded,
		   void *ctx);
void realtime_close(struct realtime *rt);

/* Hooks of a session (session_hooks); @ctx is the struct realtime. */
int realtime_cycle_start(void *ctx, struct cycle *cycle, struct failure *failure);
int realtime_cycle_end(void *ctx);
int realtime_cycle_has_ended(void *ctx);

/** 1 if the kernel of this machine keeps other work off @cpu (isolcpus). */
int realtime_is_isolated(int cpu);

#endif
