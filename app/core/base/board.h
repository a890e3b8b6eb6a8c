/* SPDX-License-Identifier: MIT */
/*
 * The command board: how output values reach the cycle. One page per writer (local, program,
 * remote), each a sequence-numbered set of values; the cycle takes the newest whole set at the
 * cycle boundary and answers with the cycle whose frame brought it to the slaves. Plain memory or a
 * shared page; one writer, one reader; neither side blocks.
 */
#ifndef BASE_BOARD_H
#define BASE_BOARD_H

#include <stdatomic.h>
#include <stdint.h>

#include "limits.h"

#define BOARD_MAGIC UINT64_C(0x3164726162716463) /* "cdqbard1" */

enum { BOARD_OUTPUTS = LIMIT_OUTPUTS }; /* the n-th output channel of the channel table */

struct board_output {
	_Atomic uint64_t raw;    /* [writer] as it goes into the image */
	_Atomic uint32_t is_set; /* [writer] 1 once it was written */
	_Atomic uint32_t put;    /* [writer] lower half of the sequence of the set it changed in */
};

struct board {
	uint64_t magic;
	uint32_t bytes;
	uint32_t reserved;
	_Atomic uint64_t sequence; /* [writer] odd: being written; even: set number * 2 */
	_Atomic uint64_t beat;     /* [writer] counts up as a sign of life; for time-outs */
	_Alignas(64) struct board_output output[BOARD_OUTPUTS];
	_Alignas(64) _Atomic uint64_t taken_sequence; /* [cycle] newest set that is in effect */
	_Atomic uint64_t taken_cycle; /* [cycle] the first whose frame came back with it */
};

/* Plain values of one set, as the cycle sees them. */
struct board_set {
	uint64_t sequence;
	uint64_t raw[BOARD_OUTPUTS];
	uint32_t put[BOARD_OUTPUTS];
	uint8_t is_set[BOARD_OUTPUTS];
};

void board_init(struct board *board);

/**
 * A board in memory that an untrusted process may write through @ret_fd: sealed, so that nobody can
 * truncate it and cause SIGBUS in the reader. NULL with errno. Free with board_unmap() and close().
 * Context: blocking.
 */
struct board *board_create_shared(int *ret_fd);
/**
 * Map a board received from another process. NULL with errno; EPROTO: not a board of this version,
 * or one that could be truncated while mapped. @fd may be closed. Context: blocking.
 */
struct board *board_map(int fd);
void board_unmap(struct board *board);

/** Put one value into the next set; board_commit() makes it visible. Context: the writer. */
void board_put(struct board *board, unsigned output, uint64_t raw);
/** Withdraw the value of one output in the next set: fail-safe from then on. Context: the writer.
 */
void board_unset(struct board *board, unsigned output);
/** Begin (makes the page odd) and commit a set. Returns its sequence. Context: the writer. */
void board_begin(struct board *board);
uint64_t board_commit(struct board *board);

/**
 * Withdraw what the set @sequence has put, unless a newer one has put it anew; a set of its own.
 * Context: the writer.
 */
void board_withdraw(struct board *board, uint64_t sequence);

/** 1 and a copy of the newest set if newer than @set->sequence and whole; else 0. RT-safe. */
int board_take(const struct board *board, unsigned output_count, struct board_set *set);
/** Report that the set with @sequence took effect in @cycle. Context: the cycle. */
void board_answer(struct board *board, uint64_t sequence, uint64_t cycle);

#endif
