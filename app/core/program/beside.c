/* SPDX-License-Identifier: MIT */
#include "program/beside.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

int program_beside(const char *name, char ret_path[PATH_MAX])
{
	char self[PATH_MAX] = ""; /* readlink() puts no zero behind it */
	const char *slash;

	if (readlink("/proc/self/exe", self, sizeof(self) - 1) < 0) {
		return -errno;
	}
	slash = strrchr(self, '/');
	if (slash == NULL) {
		return -ENOENT;
	}
	return snprintf(ret_path, PATH_MAX, "%.*s%s", (int)(slash + 1 - self), self, name) <
			       PATH_MAX
		       ? 0
		       : -ENAMETOOLONG;
}
