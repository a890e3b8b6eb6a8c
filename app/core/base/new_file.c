/* SPDX-License-Identifier: MIT */
#include "new_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pages.h"

/* Not ftruncate: a full tmpfs must fail here and not by SIGBUS in the cycle. */
static int allocate(int fd, unsigned mode, uint64_t bytes)
{
	return fchmod(fd, mode) < 0 ? -errno : -posix_fallocate(fd, 0, (off_t)bytes);
}

int new_file_create(const char *path, unsigned mode, uint64_t bytes, struct new_file *ret_file)
{
	int fd;
	int r;

	if (snprintf(ret_file->temporary, sizeof(ret_file->temporary), "%s.new", path) >=
	    (int)sizeof(ret_file->temporary)) {
		return -ENAMETOOLONG;
	}
	unlink(ret_file->temporary);
	fd = open(ret_file->temporary, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	if (fd < 0) {
		return -errno;
	}
	ret_file->bytes = bytes;
	r = allocate(fd, mode, bytes);
	if (r == 0) {
		ret_file->map =
			mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
		r = ret_file->map == MAP_FAILED ? -errno : 0;
	}
	close(fd);
	if (r < 0) {
		unlink(ret_file->temporary);
		return r;
	}
	pages_touch(ret_file->map, bytes);
	return 0;
}

int new_file_publish(struct new_file *file, const char *path)
{
	if (rename(file->temporary, path) < 0) {
		int r = -errno;

		unlink(file->temporary);
		munmap(file->map, file->bytes);
		return r;
	}
	return 0;
}
