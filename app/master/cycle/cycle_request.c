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

void cycle_slaves_set(struct cycle *cycle, uint64_t slaves)
{
	atomic_store_explicit(&cycle->wanted_slaves, slaves, memory_order_release);
}

void cycle_phase_set(struct cycle *cycle, enum cycle_phase phase)
{
	atomic_store_explicit(&cycle->wanted_phase, (int)phase, memory_order_release);
}
