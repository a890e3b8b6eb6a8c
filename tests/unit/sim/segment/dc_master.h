/* SPDX-License-Identifier: MIT */
/* What a master does to the clocks of a line, in its plainest form. */
#ifndef TESTS_UNIT_SIM_DC_MASTER_H
#define TESTS_UNIT_SIM_DC_MASTER_H

#include <stdint.h>

#include "bench.h"

/** Latch, then set delays and offsets so that the first slave's time is @now_ns, filters 0 and 12.
 */
void dc_master_align(struct bench *b, unsigned count, uint64_t now_ns);
/** @count times FRMW of the first slave's time, every @period_ns. */
void dc_master_distribute(struct bench *b, unsigned count, int64_t period_ns);
/** Largest magnitude of 0x092c over the slaves behind the first. */
uint32_t dc_master_worst_difference(struct bench *b, unsigned count);
/** Largest difference of the slaves' system times at one true time. */
int64_t dc_master_skew_ns(const struct bench *b, unsigned count);
/** Round trip beyond port 1 of slave @i, as latched. */
uint32_t dc_master_round_trip_ns(struct bench *b, unsigned i);
/** SYNC0 of slave @i from system time @start_ns on, every @cycle_ns. */
void dc_master_sync0(struct bench *b, unsigned i, uint64_t start_ns, uint32_t cycle_ns);

#endif
