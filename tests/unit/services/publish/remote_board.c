/* SPDX-License-Identifier: MIT */
#include "publish/remote_board.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include "harness/test.h"
#include "unit/services/publish/master_socket.h"

/* A master's socket, with a descriptor of the test's choice behind it. */
struct bench {
	char dir[64];
	struct remote_board rb;
	int listener;
};

static void listen_anew(struct bench *b)
{
	b->listener = master_socket_listen(b->dir);
}

static void bench_open(struct bench *b)
{
	snprintf(b->dir, sizeof(b->dir), "/tmp/ecdaq-remote-XXXXXX");
	CHECK(mkdtemp(b->dir) != NULL);
	remote_board_init(&b->rb);
	snprintf(b->rb.path, sizeof(b->rb.path), "%s/commands-remote", b->dir);
}

static void bench_close(struct bench *b)
{
	remote_board_close(&b->rb);
	close(b->listener);
	unlink(b->rb.path);
	CHECK_EQ(rmdir(b->dir), 0);
}

static void serve(const struct bench *b, int given)
{
	master_socket_serve(b->listener, given);
}

TEST(remote_board, it_comes_by_the_socket_and_anew_after_a_restart_of_the_master)
{
	struct bench b;
	struct board *board[2];
	int fd[2];

	bench_open(&b);
	CHECK_EQ(remote_board_follow(&b.rb), -ENOENT);
	for (int i = 0; i < 2; i++) {
		board[i] = board_create_shared(&fd[i]);
		CHECK(board[i] != NULL);
		listen_anew(&b);
		CHECK_EQ(remote_board_follow(&b.rb), 0); /* asked; the master has not answered */
		CHECK(b.rb.board == NULL);
		serve(&b, fd[i]);
		CHECK_EQ(remote_board_follow(&b.rb), 1);
		CHECK_EQ(remote_board_follow(&b.rb), 0);
		board_begin(b.rb.board);
		board_put(b.rb.board, 3, 70 + (unsigned)i);
		board_commit(b.rb.board);
		CHECK_EQ(board[i]->output[3].raw, 70 + (unsigned)i);
		if (i == 0) {
			close(b.listener);
			unlink(b.rb.path);
			CHECK_EQ(remote_board_follow(&b.rb), -ENOENT);
		}
	}
	for (int i = 0; i < 2; i++) {
		board_unmap(board[i]);
		close(fd[i]);
	}
	bench_close(&b);
}

TEST(remote_board, what_is_no_board_or_could_be_shortened_is_not_mapped)
{
	struct bench b;
	int bare = memfd_create("bare", MFD_CLOEXEC | MFD_ALLOW_SEALING);
	int small = memfd_create("small", MFD_CLOEXEC | MFD_ALLOW_SEALING);

	CHECK_EQ(ftruncate(bare, sizeof(struct board)), 0);
	CHECK_EQ(ftruncate(small, 64), 0);
	CHECK_EQ(fcntl(small, F_ADD_SEALS, F_SEAL_SHRINK), 0);
	bench_open(&b);
	listen_anew(&b);
	for (int i = 0; i < 4; i++) {
		const int given[] = { bare, small, -1, bare };

		if (i == 3) { /* sealed, and yet without a magic */
			CHECK_EQ(fcntl(bare, F_ADD_SEALS, F_SEAL_SHRINK), 0);
		}
		CHECK_EQ(remote_board_follow(&b.rb), 0);
		serve(&b, given[i]);
		CHECK_EQ(remote_board_follow(&b.rb), -EPROTO);
		CHECK(b.rb.board == NULL);
	}
	close(bare);
	close(small);
	bench_close(&b);
}
