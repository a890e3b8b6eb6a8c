/* SPDX-License-Identifier: MIT */
#include "board.h"

#include <string.h>

#define RELAXED memory_order_relaxed

void board_init(struct board *board)
{
	memset(board, 0, sizeof(*board));
	board->magic = BOARD_MAGIC;
	board->bytes = sizeof(*board);
}

void board_begin(struct board *board)
{
	uint64_t s = atomic_load_explicit(&board->sequence, RELAXED);

	/* A writer that died half way left it odd; it stays so until this set is whole. */
	atomic_store_explicit(&board->sequence, s | 1, RELAXED);
	atomic_thread_fence(memory_order_release);
}

void board_put(struct board *board, unsigned output, uint64_t raw)
{
	if (output < BOARD_OUTPUTS) {
		atomic_store_explicit(&board->output[output].raw, raw, RELAXED);
		atomic_store_explicit(&board->output[output].is_set, 1, RELAXED);
	}
}

void board_unset(struct board *board, unsigned output)
{
	if (output < BOARD_OUTPUTS) {
		atomic_store_explicit(&board->output[output].is_set, 0, RELAXED);
	}
}

uint64_t board_commit(struct board *board)
{
	uint64_t s = atomic_load_explicit(&board->sequence, RELAXED) + 1;

	atomic_store_explicit(&board->sequence, s, memory_order_release);
	return s;
}

int board_take(const struct board *board, unsigned output_count, struct board_set *set)
{
	uint64_t before = atomic_load_explicit(&board->sequence, memory_order_acquire);
	struct board_set copy;

	if (before == set->sequence || before % 2 != 0) {
		return 0;
	}
	for (unsigned i = 0; i < output_count && i < BOARD_OUTPUTS; i++) {
		copy.raw[i] = atomic_load_explicit(&board->output[i].raw, RELAXED);
		copy.is_set[i] =
			(uint8_t)(atomic_load_explicit(&board->output[i].is_set, RELAXED) != 0);
	}
	atomic_thread_fence(memory_order_acquire);
	if (atomic_load_explicit(&board->sequence, RELAXED) != before) {
		return 0;
	}
	for (unsigned i = 0; i < output_count && i < BOARD_OUTPUTS; i++) {
		set->raw[i] = copy.raw[i];
		set->is_set[i] = copy.is_set[i];
	}
	set->sequence = before;
	return 1;
}

void board_answer(struct board *board, uint64_t sequence, uint64_t cycle)
{
	atomic_store_explicit(&board->taken_cycle, cycle, RELAXED);
	atomic_store_explicit(&board->taken_sequence, sequence, memory_order_release);
}
