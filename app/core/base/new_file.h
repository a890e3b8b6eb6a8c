/* SPDX-License-Identifier: MIT */
/*
 * A file that other processes will map: made under another name, filled, and then given its own.
 * The directory belongs to this process alone (run_path_own_folder()), so nobody can have made a
 * file of that other name for us to write into. Context: blocking.
 */
#ifndef BASE_NEW_FILE_H
#define BASE_NEW_FILE_H

#include <stdint.h>

struct new_file {
	void *map; /* all zero, every page present */
	uint64_t bytes;
	char temporary[4096];
};

/** Make the file for @path, @bytes long (1 or more), mode @mode whatever the umask, and map it for
 * writing. What an earlier process left under the temporary name is removed. 0, or -errno; -ENOSPC:
 * the memory is allocated here, not by the first write. */
int new_file_create(const char *path, unsigned mode, uint64_t bytes, struct new_file *ret_file);

/** Give it the name @path, in place of what has it; the mapping stays, the caller's from now on. 0,
 * or -errno, and the file and the mapping are gone. */
int new_file_publish(struct new_file *file, const char *path);

#endif
