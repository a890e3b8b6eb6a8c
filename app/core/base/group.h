/* SPDX-License-Identifier: MIT */
/* The groups that a socket or a directory is given to. Context: blocking, at start. */
#ifndef BASE_GROUP_H
#define BASE_GROUP_H

#include <sys/types.h>

/**
 * The group @name; "": the group @usual, where there is one that this process may give files to. 0
 * with (gid_t)-1 where there is none; -ENOENT: @name is no group.
 */
int group_find(const char *name, const char *usual, gid_t *ret_group);

#endif
