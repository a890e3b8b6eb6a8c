/* SPDX-License-Identifier: MIT */
#include "sim/harness/run_dir.h"

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "harness/test.h"

enum { DIRS_MAX = 8, DIR_BYTES = 64 };

static int forget_file(const char *path, const struct stat *st, int kind, struct FTW *ftw)
{
	(void)st;
	(void)kind;
	(void)ftw;
	return remove(path);
}

/* A test that fails ends the program: its run directories are memory and must not stay. */
static char dirs[DIRS_MAX][DIR_BYTES];

static void forget_dirs(void)
{
	for (size_t i = 0; i < DIRS_MAX; i++) {
		if (dirs[i][0] != '\0') {
			nftw(dirs[i], forget_file, 8, FTW_DEPTH | FTW_PHYS);
			dirs[i][0] = '\0';
		}
	}
}

static void note_dir(const char *dir)
{
	static int is_registered;

	if (!is_registered) {
		is_registered = 1;
		atexit(forget_dirs);
	}
	for (size_t i = 0; i < DIRS_MAX; i++) {
		if (dirs[i][0] == '\0') {
			snprintf(dirs[i], sizeof(dirs[i]), "%s", dir);
			return;
		}
	}
}

void run_dir_remove(const char *dir)
{
	nftw(dir, forget_file, 8, FTW_DEPTH | FTW_PHYS);
	for (size_t i = 0; i < DIRS_MAX; i++) {
		if (strcmp(dirs[i], dir) == 0) {
			dirs[i][0] = '\0';
		}
	}
}

void run_dir_make(char *ret_dir, size_t dir_bytes)
{
	snprintf(ret_dir, dir_bytes, "/dev/shm/ecdaq-sim-XXXXXX");
	CHECK(mkdtemp(ret_dir) != NULL);
	note_dir(ret_dir);
}
