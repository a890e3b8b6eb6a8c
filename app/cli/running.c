/* SPDX-License-Identifier: MIT */
#include "cli/running.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "reader/page.h"

static int is_running(const char *dir, struct running *ret_running)
{
	struct status_page *page = malloc(sizeof(*page));
	char path[sizeof(ret_running->dir) + sizeof(CONFIG_RUN_STATUS)];
	int found = 0;

	snprintf(path, sizeof(path), "%s%s", dir, CONFIG_RUN_STATUS);
	if (page != NULL && page_read_status(path, page) == 0 && page_is_alive(page->pid)) {
		snprintf(ret_running->dir, sizeof(ret_running->dir), "%s", dir);
		snprintf(ret_running->interface, sizeof(ret_running->interface), "%s",
			 page->interface);
		ret_running->pid = page->pid;
		ret_running->is_simulated = page->is_simulated != 0;
		found = 1;
	}
	free(page);
	return found;
}

static int is_run_dir(const struct dirent *entry)
{
	return strncmp(entry->d_name, "ecdaq-", strlen("ecdaq-")) == 0;
}

/* A directory of somebody else could claim anything: @parent_dir may be open to all. */
static int is_own_dir(const char *dir)
{
	struct stat st;

	return lstat(dir, &st) == 0 && S_ISDIR(st.st_mode) && st.st_uid == geteuid();
}

size_t running_find(const char *system_dir, const char *parent_dir, struct running *ret_found,
		    size_t limit)
{
	struct dirent **entries = NULL;
	char dir[CONFIG_PATH_BYTES];
	size_t found = 0;
	int count;

	snprintf(dir, sizeof(dir), "%s/", system_dir);
	if (limit > 0 && is_running(dir, &ret_found[0])) {
		found = 1;
	}
	count = scandir(parent_dir, &entries, is_run_dir, alphasort);
	for (int i = 0; i < count; i++) {
		int len = snprintf(dir, sizeof(dir), "%s/%s", parent_dir, entries[i]->d_name);

		free(entries[i]);
		if (found < limit && len < (int)sizeof(dir) - 1 && is_own_dir(dir)) {
			memcpy(dir + len, "/", 2);
			found += (size_t)is_running(dir, &ret_found[found]);
		}
	}
	free(entries);
	return found;
}
