/* SPDX-License-Identifier: MIT */
#include "base/run_path.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_BYTES = 4096, FOLDER_MODE = 0750 };

const char *run_path_named(const char *dir)
{
	const char *env = getenv("ECDAQ_RUN_DIR");

	if (dir != NULL && dir[0] != '\0') {
		return dir;
	}
	return env != NULL && env[0] != '\0' ? env : NULL;
}

int run_path(const char *dir, const char *file, char *ret_path, size_t path_bytes)
{
	const char *named = run_path_named(dir);
	char path[PATH_BYTES];
	int len;

	if (named != NULL) {
		len = snprintf(path, sizeof(path), "%s/%s", named, file);
	} else if (geteuid() == 0) {
		len = snprintf(path, sizeof(path), "/run/ecdaq/%s", file);
	} else {
		len = snprintf(path, sizeof(path), "/dev/shm/ecdaq-%u/%s", (unsigned)geteuid(),
			       file);
	}
	if (len < 0 || (size_t)len >= sizeof(path) || (size_t)len >= path_bytes) {
		return -ENAMETOOLONG;
	}
	memcpy(ret_path, path, (size_t)len + 1);
	return 0;
}

int run_path_own_folder(const char *path)
{
	const char *end = strrchr(path, '/');
	char folder[PATH_BYTES];

	if (end == NULL || end == path) {
		return -EINVAL;
	}
	if ((size_t)(end - path) >= sizeof(folder)) {
		return -ENAMETOOLONG;
	}
	memcpy(folder, path, (size_t)(end - path));
	folder[end - path] = '\0';
	return mkdir(folder, FOLDER_MODE) == 0 || errno == EEXIST ? 0 : -errno;
}
