/* SPDX-License-Identifier: MIT */
/* Files that another process writes, and may truncate or replace at any time. Context: blocks only
 * as file reads on a tmpfs do. */
#ifndef BASE_FOREIGN_H
#define BASE_FOREIGN_H

#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>

/** Open the regular file at @path for reading. The descriptor, or -errno; -EPROTO: not a regular
 * file. A FIFO does not block it. */
int foreign_open(const char *path, struct stat *ret_stat);

/** Read @bytes at @offset, all of them, or -EIO: the file is shorter. */
int foreign_read(int fd, void *buf, size_t bytes, uint64_t offset);

#endif
