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
#include "config/config.h"
#include "cycle/cycle_spec.h"

struct output {
	const struct channel *channel;
	enum cycle_writer owner;
	uint64_t fail_safe_raw;
	double min; /* physical */
	double max;
	uint64_t min_raw;
	uint64_t max_raw;
	uint64_t timeout_cycles; /* 0: none */
};

struct outputs {
	struct board *board[CYCLE_WRITERS];
	struct board_set set[CYCLE_WRITERS];
	uint64_t answered[CYCLE_WRITERS]; /* sequence of the last set that was answered */
	uint64_t beat[CYCLE_WRITERS];
	uint64_t silent_cycles[CYCLE_WRITERS];
	struct output output[BOARD_OUTPUTS];
	size_t output_count;
};

/** 0, or -EINVAL / -E2BIG with one line in @error. Context: blocking. */
int outputs_init(struct outputs *outputs, const struct cycle_spec *spec, char *error,
		 size_t error_bytes);

/**
 * Write all outputs into @image. With @is_live 0 they are fail-safe. Returns how many are fail-safe
 * although they should be live (their owner is silent).
 */
unsigned outputs_choose(struct outputs *outputs, uint8_t *image, uint64_t live_slaves);

/** The image last written went on the wire in @cycle: answer the boards. */
void outputs_sent(struct outputs *outputs, uint64_t cycle);

#endif
