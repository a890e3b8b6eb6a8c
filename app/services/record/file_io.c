/* SPDX-License-Identifier: MIT */
#include "record/file_io.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

static int io_write(void *ctx, const void *data, size_t len)
{
	const char *at = data;

	while (len > 0) {
		ssize_t n = write(*(int *)ctx, at, len);

		if (n < 0 && errno == EINTR) {
			continue;
		}
		if (n < 0) {
			return -errno;
		}
		if (n == 0) {
			return -EIO;
		}
		at += n;
		len -= (size_t)n;
	}
	return 0;
}

static int io_sync(void *ctx)
{
	return fdatasync(*(int *)ctx) < 0 ? -errno : 0;
}

static int io_truncate(void *ctx, uint64_t bytes)
{
	if (ftruncate(*(int *)ctx, (off_t)bytes) < 0) {
		return -errno;
	}
	return lseek(*(int *)ctx, (off_t)bytes, SEEK_SET) < 0 ? -errno : 0;
}

struct mcap_io file_io(int *fd)
{
	return (struct mcap_io){
		.write = io_write, .sync = io_sync, .truncate = io_truncate, .ctx = fd
	};
}

static int source_read_at(void *ctx, uint64_t offset, void *buf, size_t len)
{
	char *at = buf;

	while (len > 0) {
		ssize_t n = pread(*(int *)ctx, at, len, (off_t)offset);

		if (n < 0 && errno == EINTR) {
			continue;
		}
		if (n < 0) {
			return -errno;
		}
		if (n == 0) {
			return -EIO; /* shorter than it was */
		}
		at += n;
		offset += (uint64_t)n;
		len -= (size_t)n;
	}
	return 0;
}

int file_source(int *fd, struct mcap_source *ret_source)
{
	struct stat st;

	if (fstat(*fd, &st) < 0) {
		return -errno;
	}
	if (!S_ISREG(st.st_mode)) {
		return -EINVAL;
	}
	ret_source->read_at = source_read_at;
	ret_source->bytes = (uint64_t)st.st_size;
	ret_source->ctx = fd;
	return 0;
}

static int watched_read_at(void *ctx, uint64_t offset, void *buf, size_t len)
{
	const struct file_watch *watch = ctx;

	watch->at(watch->before + offset);
	return watch->plain.read_at(watch->plain.ctx, offset, buf, len);
}

void file_watch(struct file_watch *watch, struct mcap_source *source, void (*at)(uint64_t done),
		uint64_t before)
{
	*watch = (struct file_watch){ .at = at, .before = before, .plain = *source };
	if (at != NULL) {
		source->read_at = watched_read_at;
		source->ctx = watch;
	}
}

int file_sync_dir(const char *path)
{
	int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	int r;

	if (fd < 0) {
		return -errno;
	}
	r = fsync(fd) < 0 ? -errno : 0;
	close(fd);
	return r;
}
