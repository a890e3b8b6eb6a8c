/* SPDX-License-Identifier: MIT */
/*
 * Where the run directory of ecdaqd is: the named one, else $ECDAQ_RUN_DIR, else /run/ecdaq for
 * root, else /dev/shm/ecdaq-UID. Context: blocking.
 */
#ifndef BASE_RUN_PATH_H
#define BASE_RUN_PATH_H

#include <stddef.h>

/** The directory that is named: @dir (NULL or "": none), else $ECDAQ_RUN_DIR; NULL: none is. */
const char *run_path_named(const char *dir);
/** The path of @file in it to @ret_path. 0; -ENAMETOOLONG: longer than @path_bytes, untouched. */
int run_path(const char *dir, const char *file, char *ret_path, size_t path_bytes);

/**
 * Make the folder of the file @path, if it is not there: mode 0750, and in the group of a
 * set-group-ID directory above. It has the files of one process, which alone may write there. 0, or
 * -errno; -EINVAL: @path has no folder; -ENOENT: what is above is not there either.
 */
int run_path_own_folder(const char *path);

#endif
