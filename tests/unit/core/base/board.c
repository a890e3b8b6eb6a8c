/* SPDX-License-Identifier: MIT */
#include "base/board.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include "harness/test.h"

static struct board board;
static struct board_set set;

TEST(board, a_set_is_taken_once_and_only_when_it_is_whole)
{
	uint64_t sequence;

	board_init(&board);
	memset(&set, 0, sizeof(set));
	CHECK(!board_take(&board, 8, &set));
	board_begin(&board);
	board_put(&board, 3, 77);
	CHECK(!board_take(&board, 8, &set));
	sequence = board_commit(&board);
	CHECK(board_take(&board, 8, &set));
	CHECK_EQ(set.raw[3], 77);
	CHECK_EQ(set.is_set[3], 1);
	CHECK_EQ(set.is_set[2], 0);
	CHECK_EQ(set.sequence, sequence);
	CHECK(!board_take(&board, 8, &set));
	board_answer(&board, sequence, 1234);
	CHECK_EQ(board.taken_sequence, sequence);
	CHECK_EQ(board.taken_cycle, 1234);
}

TEST(board, an_output_beyond_the_page_is_not_written)
{
	board_init(&board);
	memset(&set, 0, sizeof(set));
	board_begin(&board);
	board_put(&board, BOARD_OUTPUTS, 1);
	board_commit(&board);
	CHECK(board_take(&board, BOARD_OUTPUTS, &set));
	CHECK_EQ(set.is_set[BOARD_OUTPUTS - 1], 0);
}

static void *write_sets(void *arg)
{
	(void)arg;
	for (uint64_t i = 1; i <= 50000; i++) {
		board_begin(&board);
		for (unsigned k = 0; k < 16; k++) {
			board_put(&board, k, i * 16 + k);
		}
		board_commit(&board);
	}
	return NULL;
}

TEST(board, the_cycle_never_takes_half_a_set)
{
	pthread_t thread;
	uint64_t taken = 0;

	board_init(&board);
	memset(&set, 0, sizeof(set));
	CHECK_EQ(pthread_create(&thread, NULL, write_sets, NULL), 0);
	while (set.sequence < 100000) {
		if (board_take(&board, 16, &set)) {
			for (unsigned k = 0; k < 16; k++) {
				CHECK_EQ(set.raw[k], set.raw[0] + k);
			}
			taken++;
		}
	}
	pthread_join(thread, NULL);
	CHECK(taken > 0);
	CHECK_EQ(set.raw[0], 50000 * 16);
}

TEST(board, withdrawing_a_set_leaves_what_others_have_put)
{
	uint64_t sequence;

	board_init(&board);
	memset(&set, 0, sizeof(set));
	board_begin(&board);
	board_put(&board, 1, 10);
	board_put(&board, 2, 20);
	board_commit(&board);
	board_begin(&board);
	board_put(&board, 2, 21);
	board_put(&board, 3, 31);
	sequence = board_commit(&board);
	board_begin(&board);
	board_put(&board, 3, 32);
	board_commit(&board);
	board_withdraw(&board, sequence);
	CHECK(board_take(&board, 8, &set));
	CHECK_EQ(set.is_set[1], 1); /* put by an older one */
	CHECK_EQ(set.is_set[2], 0);
	CHECK_EQ(set.is_set[3], 1); /* put anew */
	CHECK_EQ(set.raw[3], 32);
	CHECK_EQ(set.put[2], (uint32_t)set.sequence);
	CHECK_EQ(set.put[3], (uint32_t)sequence + 2);
}

TEST(board, a_withdrawn_output_is_not_set_in_the_next_set)
{
	board_init(&board);
	memset(&set, 0, sizeof(set));
	board_begin(&board);
	board_put(&board, 3, 9);
	board_put(&board, 4, 9);
	board_commit(&board);
	board_begin(&board);
	board_unset(&board, 3);
	board_unset(&board, BOARD_OUTPUTS);
	board_commit(&board);
	CHECK_EQ(board_take(&board, 8, &set), 1);
	CHECK_EQ(set.is_set[3], 0);
	CHECK_EQ(set.is_set[4], 1);
}

TEST(board, the_receiver_of_a_shared_board_cannot_truncate_it_only_empty_it)
{
	int fd = -1;
	struct board *mine = board_create_shared(&fd);
	struct board *given;

	CHECK(mine != NULL);
	memset(&set, 0, sizeof(set));
	given = board_map(fd);
	CHECK(given != NULL);
	board_begin(given);
	board_put(given, 511, 5);
	board_commit(given);
	CHECK(board_take(mine, BOARD_OUTPUTS, &set));
	CHECK_EQ(set.raw[511], 5);
	CHECK_EQ(ftruncate(fd, 0), -1);
	CHECK_EQ(errno, EPERM);
	CHECK_EQ(ftruncate(fd, sizeof(*mine) * 2), -1);
	CHECK_EQ(fcntl(fd, F_ADD_SEALS, F_SEAL_WRITE), -1);
	CHECK_EQ(fallocate(fd, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, sizeof(*mine)), 0);
	CHECK(board_take(mine, BOARD_OUTPUTS, &set)); /* zeros: nothing is set */
	CHECK_EQ(set.is_set[511], 0);
	board_unmap(given);
	board_unmap(mine);
	close(fd);
}

/* 0 is a descriptor like any other: a service started without standard input gets it. */
TEST(board, a_shared_board_may_have_descriptor_0)
{
	int fd = -1;
	int standard_input = dup(0);
	struct board *shared;

	close(0);
	shared = board_create_shared(&fd);
	CHECK(shared != NULL);
	CHECK_EQ(fd, 0);
	board_unmap(shared);
	shared = board_map(fd);
	CHECK(shared != NULL);
	board_unmap(shared);
	close(fd);
	if (standard_input >= 0) {
		CHECK_EQ(dup2(standard_input, 0), 0);
		close(standard_input);
	}
}
