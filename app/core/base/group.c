/* SPDX-License-Identifier: MIT */
#include "base/group.h"

#include <errno.h>
#include <grp.h>
#include <limits.h>
#include <stddef.h>
#include <unistd.h>

enum { GROUP_BYTES = 4096 };

static int is_member(gid_t group)
{
	gid_t groups[NGROUPS_MAX];
	int n = getgroups(NGROUPS_MAX, groups);

	for (int i = 0; i < n; i++) {
		if (groups[i] == group) {
			return 1;
		}
	}
	return group == getegid() || geteuid() == 0;
}

int group_find(const char *name, const char *usual, gid_t *ret_group)
{
	struct group entry;
	struct group *found = NULL;
	char buf[GROUP_BYTES];

	getgrnam_r(name[0] != '\0' ? name : usual, &entry, buf, sizeof(buf), &found);
	if (name[0] != '\0' && found == NULL) {
		return -ENOENT;
	}
	*ret_group = found != NULL && (name[0] != '\0' || is_member(found->gr_gid)) ? found->gr_gid
										    : (gid_t)-1;
	return 0;
}
