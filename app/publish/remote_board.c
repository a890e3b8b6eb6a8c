/* SPDX-License-Identifier: MIT */
#include "publish/remote_board.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static int map_board(struct remote_board *rb, int fd)
{
	struct stat st;
	struct board *board;

	if (fstat(fd, &st) < 0) {
		return -errno;
	}
	if (st.st_size != (off_t)sizeof(*board)) {
		return -EPROTO;
	}
	board = mmap(NULL, sizeof(*board), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
	if (board == MAP_FAILED) {
		return -errno;
	}
	if (board->magic != BOARD_MAGIC || board->bytes != sizeof(*board)) {
		munmap(board, sizeof(*board));
		return -EPROTO;
	}
	rb->board = board;
	rb->inode = st.st_ino;
	rb->device = st.st_dev;
	return 1;
}

int remote_board_follow(struct remote_board *rb)
{
	struct stat st;
	int fd;
	int r;

	if (stat(rb->path, &st) < 0) {
		return -errno;
	}
	if (rb->board != NULL && rb->inode == st.st_ino && rb->device == st.st_dev) {
		return 0;
	}
	remote_board_close(rb);
	fd = open(rb->path, O_RDWR | O_CLOEXEC | O_NOFOLLOW);
	if (fd < 0) {
		return -errno;
	}
	r = map_board(rb, fd);
	close(fd);
	return r;
}

void remote_board_close(struct remote_board *rb)
{
	if (rb->board != NULL) {
		munmap(rb->board, sizeof(*rb->board));
		rb->board = NULL;
	}
}
