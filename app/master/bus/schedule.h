/* SPDX-License-Identifier: MIT */
/*
 * Do the cyclic frames fit into the period? Computed from their bytes, the slaves, and what their
 * ports have latched, before the cycle runs. Pure.
 */
#ifndef BUS_SCHEDULE_H
#define BUS_SCHEDULE_H

#include <stddef.h>
#include <stdint.h>

#include "bus/dc_topology.h"
#include "bus/exchange_plan.h"

struct schedule {
	int64_t wire_ns;            /* the frames one after the other, 80 ns a byte */
	int64_t path_ns;            /* from the master through all slaves and back */
	int64_t need_ns;            /* first frame out to last frame back, with the host's share */
	int64_t allowed_ns;         /* cycle.receive of the period */
	int64_t smallest_period_ns; /* in which they fit, and a service frame, too */
	size_t service_frame_bytes; /* the longest service frame that any cycle has room for */
};

/**
 * From the first slave with receive times (0x0900) on the path is what it latched; the wire to it,
 * and each slave without, count 1 us. @receive_percent of @period_ns is for the answer.
 */
struct schedule schedule_compute(const struct exchange_plan *plan, const struct dc_node *node,
				 size_t count, int64_t period_ns, double receive_percent);

#endif
