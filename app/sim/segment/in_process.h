/* SPDX-License-Identifier: MIT */
/*
 * A segment as the master's platform and transport, in one process on virtual time: nothing waits,
 * a sleep moves the clock, and the same seed gives the same run. The host's clock runs off true
 * time by its ppm; its wakes are late by a seeded latency.
 */
#ifndef SIM_SEGMENT_IN_PROCESS_H
#define SIM_SEGMENT_IN_PROCESS_H

#include <stdint.h>

#include "base/platform.h"
#include "segment/fault.h"
#include "segment/segment.h"

struct in_process;

struct in_process_spec {
	struct segment *segment; /* not taken over */
	uint64_t seed;
	double host_ppm;       /* of the host's monotonic clock against true time */
	int64_t tai_start_ns;  /* CLOCK_TAI when the host's clock is 0 */
	int64_t wake_sigma_ns; /* wake latency: |N(0, sigma)| ... */
	int64_t wake_spike_ns; /* ... and now and then uniform up to this */
	uint32_t spikes_per_million;
	int64_t transmit_ns;       /* send to the wire, and the wire to receive */
	struct fault_plan *faults; /* NULL: none; not taken over */
};

int in_process_create(const struct in_process_spec *spec, struct in_process **ret);
void in_process_destroy(struct in_process *ip);

struct platform in_process_platform(struct in_process *ip);
/** Its destroy does nothing: the in_process outlives the master (a second master can come). */
struct transport in_process_transport(struct in_process *ip);

/** True time of the host's instant @now, for tests. */
int64_t in_process_true_ns(const struct in_process *ip, mono_t now);
/** A step of the wall clock: CLOCK_TAI jumps, nothing else does. */
void in_process_step_tai(struct in_process *ip, int64_t step_ns);
/** Make the next wake late by @late_ns. */
void in_process_stall(struct in_process *ip, int64_t late_ns);
/** Frames on the wire. */
unsigned in_process_in_flight(const struct in_process *ip);

#endif
