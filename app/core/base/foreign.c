/* SPDX-License-Identifier: MIT */
#include "foreign.h"

#include <errno.h>
#include <fcntl.h>
#include <unistd.h>

int foreign_open(const char *path, struct stat *ret_stat)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	int r;

	if (fd < 0) {
		return -errno;
	}
	r = fstat(fd, ret_stat) < 0 ? -errno : S_ISREG(ret_stat->st_mode) ? fd : -EPROTO;
	if (r < 0) {
		close(fd);
	}
	return r;
}

int foreign_read(int fd, void *buf, size_t bytes, uint64_t offset)
{
	uint8_t *out = buf;

	while (bytes > 0) {
		ssize_t n = pread(fd, out, bytes, (off_t)offset);

		if (n < 0 && errno == EINTR) {
			continue;
		}
		if (n <= 0) {
			return -EIO;
		}
		out += n;
		offset += (uint64_t)n;
		bytes -= (size_t)n;
	}
	return 0;
}
