/* SPDX-License-Identifier: MIT */
#include "cli/config_file.h"

#include <stdio.h>
#include <string.h>

#include "cli/source.h"
#include "reader/page.h"

static int append(struct args_list *set, const char *assignment)
{
	if (set->count == ARGS_LIST_LIMIT) {
		return -1;
	}
	set->item[set->count++] = assignment;
	return 0;
}

/* The ecdaqd of the run directory, if it is running. */
static enum exit_code find_daemon(struct cli *cli, int64_t *ret_pid)
{
	const struct status_page *page;
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(cli, CONFIG_RUN_STATUS, path);

	*ret_pid = 0;
	if (result == EXIT_CODE_OK && source_try_status(cli, &page) == 0) {
		*ret_pid = page_is_alive(page->pid) ? page->pid : 0;
		source_status_close(page);
	}
	return result;
}

static int take_words(struct config_file *file, const struct probe *probe, int64_t pid)
{
	struct resolve_words words = { .config = NULL };
	int r = 0;

	file->name = "defaults";
	if (!resolve_words(probe, pid, file->text, &words)) {
		return 0;
	}
	if (words.config != NULL &&
	    resolve_config_path(probe, pid, words.config, file->opened) == 0) {
		file->path = file->opened;
		file->name = words.config;
	}
	for (size_t i = 0; i < words.set_count && r == 0; i++) {
		r = append(&file->set, words.set[i]);
	}
	if (words.interface != NULL && r == 0) {
		snprintf(file->interface, sizeof(file->interface), "bus.interface=%.40s",
			 words.interface);
		r = append(&file->set, file->interface);
	}
	return r;
}

enum exit_code config_file_find(struct cli *cli, const char *named, const struct args_list *more,
				struct config_file *ret_file)
{
	const struct probe here = { .root = "" };
	enum exit_code result;
	int64_t pid;
	int r = 0;

	*ret_file = (struct config_file){ .path = named != NULL ? named : cli->config };
	ret_file->name = ret_file->path;
	if (ret_file->path == NULL) {
		result = find_daemon(cli, &pid);
		if (result != EXIT_CODE_OK) {
			return result;
		}
		r = take_words(ret_file, &here, pid);
	}
	for (size_t i = 0; i < more->count && r == 0; i++) {
		r = append(&ret_file->set, more->item[i]);
	}
	return r == 0 ? EXIT_CODE_OK
		      : cli_fail(cli, EXIT_CODE_USAGE, "--set: more than %d", ARGS_LIST_LIMIT);
}
