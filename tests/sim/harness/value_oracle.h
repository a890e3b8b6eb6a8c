/* SPDX-License-Identifier: MIT */
/*
 * What the samples of FB1111-Piccolo boards must hold: a good one has the value that its analog
 * input had at the SYNC0 edge of the sample. The simulated signals are steep, so that two edges
 * differ, and have another phase in each slave.
 */
#ifndef TESTS_SIM_HARNESS_VALUE_ORACLE_H
#define TESTS_SIM_HARNESS_VALUE_ORACLE_H

#include "sim/harness/virtual_master.h"

/** A virtual_slave_maker: a board with the signal of @position. */
int value_oracle_slave(int position, struct segment_slave_spec *ret_spec);

/**
 * Compare the newest sample of slave @slave, whose channels begin with @name. 1: good and as it
 * was; 0: not a good sample; -1: called good and wrong, with both values in @ret_got and @ret_was
 * (0: there was no edge).
 */
int value_oracle_check(const struct virtual_master *vm, unsigned slave, const char *name,
		       uint64_t *ret_got, uint64_t *ret_was);

#endif
