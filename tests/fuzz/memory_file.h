/* SPDX-License-Identifier: MIT */
/* A file that is only in memory, for what reads files. */
#ifndef TESTS_FUZZ_MEMORY_FILE_H
#define TESTS_FUZZ_MEMORY_FILE_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

/* Its path; close() the result. */
static inline int memory_file(const uint8_t *data, size_t size, char ret_path[32])
{
	int fd = memfd_create("fuzz", MFD_CLOEXEC);

	if (fd < 0 || (size > 0 && write(fd, data, size) != (ssize_t)size)) {
		abort();
	}
	snprintf(ret_path, 32, "/proc/self/fd/%d", fd);
	return fd;
}

#endif
