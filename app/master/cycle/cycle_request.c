/* SPDX-License-Identifier: MIT */
/* Requests of other threads to the cycle; they take effect at the next cycle boundary. */
#include "cycle/cycle_internal.h"

int cycle_has_stopped(const struct cycle *cycle, int *ret_result)
{
	if (!atomic_load_explicit(&cycle->stop, memory_order_acquire)) {
		return 0;
	}
	*ret_result = cycle->result;
	return 1;
}

void cycle_stop(struct cycle *cycle)
{
	atomic_store_explicit(&cycle->stop, 1, memory_order_release);
}

void cycle_slaves_set(struct cycle *cycle, const struct slave_set *slaves, uint64_t alerts)
{
	struct cycle_slaves *ws = &cycle->wanted_slaves;

	ws->named[ws->filled] = (struct cycle_named){ .slaves = *slaves, .alerts = alerts };
	ws->filled = atomic_exchange_explicit(&ws->spare, ws->filled | CYCLE_SLAVES_NEW,
					      memory_order_acq_rel) &
		     ~CYCLE_SLAVES_NEW;
}

void cycle_slaves_init(struct cycle *cy)
{
	struct cycle_slaves *ws = &cy->wanted_slaves;

	ws->filled = 0;
	ws->taken = 1;
	ws->named[ws->taken].slaves = slave_set_all(LIMIT_SLAVES);
	atomic_init(&ws->spare, 2);
}

const struct cycle_named *cycle_named_take(struct cycle *cy)
{
	struct cycle_slaves *ws = &cy->wanted_slaves;

	if (atomic_load_explicit(&ws->spare, memory_order_relaxed) & CYCLE_SLAVES_NEW) {
		ws->taken = atomic_exchange_explicit(&ws->spare, ws->taken, memory_order_acq_rel) &
			    ~CYCLE_SLAVES_NEW;
	}
	return &ws->named[ws->taken];
}

void cycle_phase_set(struct cycle *cycle, enum cycle_phase phase)
{
	atomic_store_explicit(&cycle->wanted_phase, (int)phase, memory_order_release);
}

int cycle_outputs_set(struct cycle *cycle, const struct config *cfg, char *error,
		      size_t error_bytes)
{
	return outputs_rules_set(&cycle->outputs, cfg, error, error_bytes);
}
