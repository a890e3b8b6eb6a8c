/* SPDX-License-Identifier: MIT */
/* MCAP bytes from and to a file. Context: blocking. */
#ifndef RECORD_FILE_IO_H
#define RECORD_FILE_IO_H

#include "record/mcap.h"

/** Append to *@fd, which must stay where it is as long as the io is used. Short writes are
 * continued. */
struct mcap_io file_io(int *fd);

/** Read from *@fd as long as it is now. 0 or -errno. */
int file_source(int *fd, struct mcap_source *ret_source);

/* Tells how far the reading of a source is. */
struct file_watch {
	void (*at)(uint64_t done);
	uint64_t before; /* done, when the reading begins */
	struct mcap_source plain;
};

/** @source, each read of which calls @at (NULL: none) with @before and the place in it; @watch must
 * stay where it is as long as @source is used. */
void file_watch(struct file_watch *watch, struct mcap_source *source, void (*at)(uint64_t done),
		uint64_t before);

/** fsync the directory at @path, so that names in it are durable. 0 or -errno. */
int file_sync_dir(const char *path);

#endif
