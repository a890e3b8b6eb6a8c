/* SPDX-License-Identifier: MIT */
#include "board.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#define RELAXED memory_order_relaxed

void board_init(struct board *board)
{
	memset(board, 0, sizeof(*board));
	board->magic = BOARD_MAGIC;
	board->bytes = sizeof(*board);
}

static struct board *map(int fd)
{
	void *board = mmap(NULL, sizeof(struct board), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);

	return board == MAP_FAILED ? NULL : board;
}

static struct board *fill_shared(int fd)
{
	struct board *board;

	if (ftruncate(fd, sizeof(*board)) < 0 ||
	    fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) < 0) {
		return NULL;
	}
	board = map(fd);
	if (board != NULL) {
		board_init(board); /* writes every page, so that the cycle is not the first to */
	}
	return board;
}

struct board *board_create_shared(int *ret_fd)
{
	int fd = memfd_create("ecdaq-board", MFD_CLOEXEC | MFD_ALLOW_SEALING);
	struct board *board;

	if (fd < 0) {
		return NULL;
	}
	board = fill_shared(fd);
	if (board == NULL) {
		int err = errno;

		close(fd);
		errno = err;
		return NULL;
	}
	*ret_fd = fd;
	return board;
}

struct board *board_map(int fd)
{
	struct board *board;
	struct stat st;
	int seals = fcntl(fd, F_GET_SEALS);

	if (fstat(fd, &st) < 0) {
		return NULL;
	}
	if (seals < 0 || (seals & F_SEAL_SHRINK) == 0 || st.st_size != (off_t)sizeof(*board)) {
		errno = EPROTO;
		return NULL;
	}
	board = map(fd);
	if (board != NULL && (board->magic != BOARD_MAGIC || board->bytes != sizeof(*board))) {
		board_unmap(board);
		errno = EPROTO;
		return NULL;
	}
	return board;
}

void board_unmap(struct board *board)
{
	if (board != NULL) {
		munmap(board, sizeof(*board));
	}
}

void board_begin(struct board *board)
{
	uint64_t s = atomic_load_explicit(&board->sequence, RELAXED);

	/* A writer that died during a set left it odd; it stays odd until this set is complete. */
	atomic_store_explicit(&board->sequence, s | 1, RELAXED);
	atomic_thread_fence(memory_order_release);
}

/* The sequence that board_commit() will give, while the set is odd. */
static void mark(struct board *board, unsigned output)
{
	uint64_t s = atomic_load_explicit(&board->sequence, RELAXED) + 1;

	atomic_store_explicit(&board->output[output].put, (uint32_t)s, RELAXED);
}

void board_put(struct board *board, unsigned output, uint64_t raw)
{
	if (output < BOARD_OUTPUTS) {
		mark(board, output);
		atomic_store_explicit(&board->output[output].raw, raw, RELAXED);
		atomic_store_explicit(&board->output[output].is_set, 1, RELAXED);
	}
}

void board_unset(struct board *board, unsigned output)
{
	if (output < BOARD_OUTPUTS) {
		mark(board, output);
		atomic_store_explicit(&board->output[output].is_set, 0, RELAXED);
	}
}

void board_withdraw(struct board *board, uint64_t sequence)
{
	board_begin(board);
	for (unsigned i = 0; i < BOARD_OUTPUTS; i++) {
		if (atomic_load_explicit(&board->output[i].is_set, RELAXED) != 0 &&
		    atomic_load_explicit(&board->output[i].put, RELAXED) == (uint32_t)sequence) {
			board_unset(board, i);
		}
	}
	board_commit(board);
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
	unsigned count = output_count < BOARD_OUTPUTS ? output_count : BOARD_OUTPUTS;
	struct board_set copy;

	if (before == set->sequence || before % 2 != 0) {
		return 0;
	}
	for (unsigned i = 0; i < count; i++) {
		copy.raw[i] = atomic_load_explicit(&board->output[i].raw, RELAXED);
		copy.put[i] = atomic_load_explicit(&board->output[i].put, RELAXED);
		copy.is_set[i] =
			(uint8_t)(atomic_load_explicit(&board->output[i].is_set, RELAXED) != 0);
	}
	atomic_thread_fence(memory_order_acquire);
	if (atomic_load_explicit(&board->sequence, RELAXED) != before) {
		return 0;
	}
	memcpy(set->raw, copy.raw, count * sizeof(copy.raw[0]));
	memcpy(set->put, copy.put, count * sizeof(copy.put[0]));
	memcpy(set->is_set, copy.is_set, count * sizeof(copy.is_set[0]));
	set->sequence = before;
	return 1;
}

void board_answer(struct board *board, uint64_t sequence, uint64_t cycle)
{
	atomic_store_explicit(&board->taken_cycle, cycle, RELAXED);
	atomic_store_explicit(&board->taken_sequence, sequence, memory_order_release);
}
