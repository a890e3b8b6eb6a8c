/* SPDX-License-Identifier: MIT */
/* Our other programs: they are in the folder of the one that is running. Context: any. */
#ifndef PROGRAM_BESIDE_H
#define PROGRAM_BESIDE_H

#include <limits.h>

/** The path of the program @name. 0, -ENAMETOOLONG, -ENOENT, or -errno of reading /proc/self/exe.
 */
int program_beside(const char *name, char ret_path[PATH_MAX]);

#endif
