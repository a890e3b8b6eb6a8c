/* SPDX-License-Identifier: MIT */
/*
 * What goes out: for each output channel, the newest value its owner has put on its board, within
 * its limits; its fail-safe value while there is none, while the bus is not in OP, or when the
 * owner has been silent for too long. Context of outputs_choose(): cycle thread, RT-safe.
 */
#ifndef CYCLE_OUTPUTS_H
#define CYCLE_OUTPUTS_H

#include <stddef.h>
#include <stdint.h>

#include "base/board.h"
#include "base/sample.h"
#include "base/slave_set.h"
#include "config/config.h"
#include "cycle/cycle_spec.h"

struct output {
	const struct channel *channel;
	enum cycle_writer owner;
	uint64_t fail_safe_raw;
	double min; /* physical; infinite: no limit */
	double max;
	uint64_t min_raw;
	uint64_t max_raw;
	uint64_t timeout_cycles; /* by cycle number: skipped cycles count; 0: none */
};

struct outputs {
	struct board *board[CYCLE_WRITERS];
	struct board_set set[CYCLE_WRITERS];
	uint64_t answered[CYCLE_WRITERS]; /* sequence of the last set that was answered */
	uint64_t beat[CYCLE_WRITERS];
	uint64_t alive_cycle[CYCLE_WRITERS]; /* the last with a sign of life of the writer */
	struct output output[BOARD_OUTPUTS];
	uint8_t is_live[BOARD_OUTPUTS]; /* the image last written carries its owner's value */
	size_t output_count;
};

/** 0, or -EINVAL / -E2BIG with one line in @error. Context: blocking. */
int outputs_init(struct outputs *outputs, const struct cycle_spec *spec, char *error,
		 size_t error_bytes);

/**
 * Write all outputs into @image: live for slaves in @live, fail-safe for all others, for a value
 * that is not a number, and for an owner that has been silent for longer than its timeout at
 * @cycle. Returns how many are fail-safe because of the latter.
 */
unsigned outputs_choose(struct outputs *outputs, uint8_t *image, const struct slave_set *live,
			uint64_t cycle);

/**
 * The image last written reached the slaves of @arrived with the frame of @cycle. Answers the
 * boards whose newest set is in effect with that: every value that it has put or withdrawn.
 */
void outputs_arrived(struct outputs *outputs, const struct slave_set *arrived, uint64_t cycle);

#endif
