/* SPDX-License-Identifier: MIT */
/*
 * A line of FB1111-Piccolo boards on the real ESC model, and a small master that talks to them in
 * single datagrams. Nothing here knows the firmware: it is reached through the wire.
 */
#ifndef TESTS_UNIT_FIRMWARE_ON_ESC_BENCH_H
#define TESTS_UNIT_FIRMWARE_ON_ESC_BENCH_H

#include <stddef.h>
#include <stdint.h>

#include "segment/segment.h"

enum { BENCH_SLAVES = 2, BENCH_CYCLE_NS = 1000000 };

struct bench_input {
	uint16_t adc;
	uint16_t counter;
	uint64_t sample_time_ns;
	uint8_t status;
};

struct bench {
	struct segment *segment;
	int64_t now_ns;
	uint32_t cycle_ns; /* BENCH_CYCLE_NS unless changed before bench_periodic_op() */
	unsigned mailbox_counter[BENCH_SLAVES];
	/* the last SYNC0 edge of each slave, true and system time */
	int64_t edge_ns[BENCH_SLAVES];
	uint64_t edge_system_ns[BENCH_SLAVES];
	unsigned edges[BENCH_SLAVES];
	int64_t copy_ns_max[BENCH_SLAVES]; /* longest time from an edge to its sample in SM3 */
};

void bench_begin(struct bench *b);
void bench_end(struct bench *b);
void bench_run(struct bench *b, int64_t span_ns);
/** To true time @t_ns. */
void bench_run_to(struct bench *b, int64_t t_ns);

/** One datagram to slave @slave; returns the working counter. */
unsigned bench_write(struct bench *b, unsigned slave, uint16_t address, const void *data,
		     size_t len);
unsigned bench_read(struct bench *b, unsigned slave, uint16_t address, void *data, size_t len);
void bench_put(struct bench *b, unsigned slave, uint16_t address, uint64_t value, size_t len);
uint64_t bench_get(struct bench *b, unsigned slave, uint16_t address, size_t len);

/** Request a state and wait 3 ms; returns AL status. */
uint16_t bench_request(struct bench *b, unsigned slave, uint16_t control);
uint16_t bench_code(struct bench *b, unsigned slave);
void bench_outputs(struct bench *b, unsigned slave, uint8_t led, uint64_t oneshot_ns);
struct bench_input bench_inputs(struct bench *b, unsigned slave);
/** SDO, expedited; abort code or 0. */
uint32_t bench_sdo_write(struct bench *b, unsigned slave, uint16_t index, uint8_t subindex,
			 uint32_t value, size_t len);
uint32_t bench_sdo_read(struct bench *b, unsigned slave, uint16_t index, uint8_t subindex,
			uint32_t *ret_value);

/** To PRE-OP with all SyncManagers set. */
void bench_preop(struct bench *b, unsigned slave);
/** SYNC0 from 2 ms ahead, SAFEOP, OP; @now ends half a cycle behind an edge. */
void bench_periodic_op(struct bench *b, unsigned slave);
/** One-shot mode to OP. */
void bench_oneshot_op(struct bench *b, unsigned slave);

#endif
