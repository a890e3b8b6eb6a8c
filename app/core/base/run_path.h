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

#endif
