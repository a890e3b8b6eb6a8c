/* SPDX-License-Identifier: MIT */
/*
 * The process data cycle. cycle_step() is one: wake, exchange, servo, check, outputs, sample;
 * cycle_run() repeats it until cycle_stop(). After cycle_create() nothing here allocates, locks,
 * logs, opens or blocks but the platform's sleep and the transport.
 */
#ifndef CYCLE_CYCLE_H
#define CYCLE_CYCLE_H

#include <stddef.h>
#include <stdint.h>

#include "base/slave_set.h"
#include "cycle/cycle_spec.h"

struct cycle;

/** 0 or -errno; -EINVAL with one line in @error for outputs that name no channel. */
int cycle_create(const struct cycle_spec *spec, struct cycle **ret_cycle, char *error,
		 size_t error_bytes);
void cycle_destroy(struct cycle *cycle);

/** One cycle. Context: the cycle thread. */
void cycle_step(struct cycle *cycle);
/** Steps until cycle_stop(); touches its stack first and counts its own page faults. 0 or -errno.
 */
int cycle_run(struct cycle *cycle);
/** 1 and cycle_run()'s result in @ret_result if it is to return, or has. Context: any. */
int cycle_has_stopped(const struct cycle *cycle, int *ret_result);
/** When cycle_run() wakes next; in the past while it is at work. Context: any. */
mono_t cycle_next_wake(const struct cycle *cycle);
/** Request cycle_run() to return after the current step. Context: any, also a signal handler. */
void cycle_stop(struct cycle *cycle);

/*
 * Phase of the bus, as known to the service thread. Outputs are real only in CYCLE_OP, samples
 * are judged only in CYCLE_OP.
 */
enum cycle_phase {
	CYCLE_CLOCKS, /* exchange and servo only */
	CYCLE_SYNCED, /* SYNC0 runs */
	CYCLE_OP,     /* all slaves are in OP, but for those that frames show to have left */
	CYCLE_SAFE,   /* on the way down: outputs at fail-safe */
};
/** Context: service thread; takes effect at the next cycle boundary. */
void cycle_phase_set(struct cycle *cycle, enum cycle_phase phase);
/**
 * Grows whenever a frame shows what the service thread has to look at: a slave has left OP, or
 * another number of slaves answers. 0 at first. Context: any.
 */
uint64_t cycle_alerts(const struct cycle *cycle);
/**
 * In CYCLE_OP, the slaves that are in OP; all at first. The others' outputs are at fail-safe, and
 * their samples are bad and not counted. Not all: with a plan that is split only. @alerts:
 * cycle_alerts() before the slaves' states were read; what frames have shown since stays in force.
 * Context: service thread; takes effect at the next cycle boundary.
 */
void cycle_slaves_set(struct cycle *cycle, const struct slave_set *slaves, uint64_t alerts);

/**
 * Fail-safe values, limits and timeouts of outputs as @cfg has them; their owners stay. 0, or
 * -EINVAL with one line in @error: nothing has changed. Context: service thread; takes effect at
 * the next cycle boundary.
 */
int cycle_outputs_set(struct cycle *cycle, const struct config *cfg, char *error,
		      size_t error_bytes);

/** The newest frame's DC time and the host time at which it was sent. 0 or -EAGAIN. Context: any.
 */
int cycle_dc_now(const struct cycle *cycle, int64_t *ret_dc_ns);

#endif
