/* SPDX-License-Identifier: MIT */
/* A WAGO node on the bench, and a master's hand on its states, process data and mailbox. */
#ifndef TESTS_UNIT_SIM_WAGO_BENCH_H
#define TESTS_UNIT_SIM_WAGO_BENCH_H

#include <stddef.h>
#include <stdint.h>

#include "bench.h"
#include "segment/signal.h"

enum {
	WAGO_BENCH_BYTES = 14, /* each way, of the node with 750-457, -557, -430, -530 */
	WAGO_BENCH_BOX = 512,
};

/** The node @name in INIT. Its analog inputs see *@signal (kept); NULL: nothing connected. */
struct bench *wago_bench_create(const char *name, const struct signal_spec *signal);
struct sim_device *wago_bench_device(struct bench *b);
/** Ask for @control, wait; AL status. */
uint16_t wago_bench_request(struct bench *b, uint16_t control);
/** INIT to PRE-OP; PRE-OP to SAFE-OP and to OP, with the process data of that node. */
void wago_bench_preop(struct bench *b);
void wago_bench_safeop(struct bench *b);
void wago_bench_op(struct bench *b, const uint8_t *outputs);

/** Write outputs, wait two K-bus cycles, read inputs. */
void wago_bench_exchange(struct bench *b, const uint8_t *outputs, uint8_t *ret_inputs);
int wago_bench_get(struct bench *b, size_t slot, unsigned channel);

/** One mailbox request (CoE header first) and its answer's length. */
size_t wago_bench_coe(struct bench *b, const uint8_t *request, size_t len, uint8_t *answer);
/** Upload of up to 4 bytes; an abort code of the same comes back with *ret_is_abort 1. */
uint32_t wago_bench_upload(struct bench *b, uint16_t index, uint8_t subindex, int *ret_is_abort);

#endif
