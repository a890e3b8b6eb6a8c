/* SPDX-License-Identifier: MIT */
/* Run directories of a test: on a tmpfs, removed at the end of the program, however it ends. */
#ifndef TESTS_SIM_HARNESS_RUN_DIR_H
#define TESTS_SIM_HARNESS_RUN_DIR_H

#include <stddef.h>

/** Make a new one and write its path to @ret_dir. Ends the test if it cannot. */
void run_dir_make(char *ret_dir, size_t dir_bytes);
void run_dir_remove(const char *dir);

#endif
