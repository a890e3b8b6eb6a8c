/* SPDX-License-Identifier: MIT */
/* The bench of the example: one WAGO 750-354 with 750-457, 750-557, 750-430, 750-530. */
#ifndef TESTS_SIM_LOOPBACK_COUPLER_H
#define TESTS_SIM_LOOPBACK_COUPLER_H

#include "sim/harness/virtual_master.h"

/* Modules on the K-bus, from 0. */
enum coupler_slot { COUPLER_AI = 0, COUPLER_AO = 1, COUPLER_DI = 2, COUPLER_DO = 3 };

/** One coupler that sees a sine of @frequency_hz, 4 V around 1 V. */
void coupler_bench_init(struct virtual_bench *bench, double frequency_hz);
/** The coupler as a slave of a bench. */
int coupler_make(int position, struct segment_slave_spec *ret_spec);
/** A master on it; ends the test with its line if it does not reach OP. */
void coupler_bring_up(struct virtual_master *vm, struct virtual_bench *bench,
		      const char *const *settings);

/** At the coupler's terminals; channels count from 1. */
int coupler_get(const struct virtual_bench *bench, enum coupler_slot slot, unsigned channel);
void coupler_set(const struct virtual_bench *bench, enum coupler_slot slot, unsigned channel,
		 int is_on);

#endif
