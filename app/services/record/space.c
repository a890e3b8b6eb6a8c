/* SPDX-License-Identifier: MIT */
#include "record/space.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "record/store.h"

/* So many files fill what there is to be filled, at least. */
enum { SPACE_FILES = 8, SPACE_LEAST_BYTES = 1 << 19 };
/* For the metadata at the end of a file. */
enum { SPACE_END_BYTES = 4096 };

static int look(struct space *sp)
{
	const struct record_seam *seam = sp->opt->seam;
	struct statvfs fs;

	if (seam != NULL && seam->free_bytes != NULL) {
		return seam->free_bytes(seam->ctx, sp->opt->dir, &sp->bytes_free);
	}
	if (statvfs(sp->opt->dir, &fs) < 0) {
		return -errno;
	}
	sp->bytes_free = (uint64_t)fs.f_bavail * fs.f_frsize;
	return 0;
}

static uint64_t beyond(uint64_t value, uint64_t limit)
{
	return value > limit ? value - limit : 0;
}

/* How much is too much, by the figures of the newest look. */
static uint64_t excess(const struct space *sp, const struct record_file *file, uint64_t more)
{
	const struct recorder_options *opt = sp->opt;
	uint64_t open_bytes = file != NULL ? record_file_final_bytes(file) + SPACE_END_BYTES : 0;
	uint64_t written = file != NULL ? record_file_bytes(file) : 0;
	uint64_t wanted = opt->reserve_bytes + more + (open_bytes - written);
	/* A small budget has no use for the margin of a large disk. */
	uint64_t more_of_budget = more < opt->budget_bytes / 8 ? more : opt->budget_bytes / 8;
	uint64_t over_budget =
		opt->budget_bytes == 0
			? 0
			: beyond(sp->bytes_kept + open_bytes + more_of_budget, opt->budget_bytes);
	uint64_t over_disk = beyond(wanted, sp->bytes_free);

	return over_budget > over_disk ? over_budget : over_disk;
}

static int may_delete(const struct space *sp)
{
	return sp->opt->when_full == CONFIG_WHEN_FULL_OLDEST && sp->opt->budget_bytes > 0;
}

static int delete_oldest(struct space *sp, const struct record_file *file, uint64_t more,
			 const struct store_entry *entry, size_t count)
{
	uint64_t deletable = 0;
	char path[PATH_MAX];
	int r = 0;

	for (size_t i = 0; i < count; i++) {
		deletable += entry[i].is_part || entry[i].is_pinned ? 0 : entry[i].bytes;
	}
	if (!may_delete(sp) || deletable < excess(sp, file, more)) {
		return -ENOSPC;
	}
	for (size_t i = 0; i < count && excess(sp, file, more) > 0; i++) {
		if (entry[i].is_part || entry[i].is_pinned ||
		    store_path(sp->opt->dir, entry[i].name, path, sizeof(path)) < 0 ||
		    unlink(path) < 0) {
			continue;
		}
		sp->bytes_kept -= entry[i].bytes;
		r = look(sp);
		if (r < 0) {
			return r;
		}
	}
	return excess(sp, file, more) > 0 ? -ENOSPC : 0;
}

int space_make(struct space *sp, const struct record_file *file, uint64_t more)
{
	const char *open_path = file != NULL ? record_file_path(file) : "";
	struct store_entry *entry = NULL;
	size_t count = 0;
	int r = store_list_all(sp->opt->dir, &entry, &count);

	r = r < 0 ? r : look(sp);
	if (r < 0) {
		free(entry);
		return r;
	}
	sp->bytes_kept = 0;
	for (size_t i = 0; i < count; i++) {
		const char *slash = strrchr(open_path, '/');
		int is_open = slash != NULL && strcmp(slash + 1, entry[i].name) == 0;

		sp->bytes_kept += is_open ? 0 : entry[i].bytes;
	}
	r = excess(sp, file, more) > 0 ? delete_oldest(sp, file, more, entry, count) : 0;
	free(entry);
	return r;
}

int space_to_begin(struct space *sp)
{
	uint64_t more = sp->opt->reserve_bytes / 8;

	return space_make(sp, NULL, more > SPACE_LEAST_BYTES ? more : SPACE_LEAST_BYTES);
}

int space_for_chunk(struct space *sp, const struct record_file *file)
{
	uint64_t bytes = record_file_bytes(file);

	sp->chunk_bytes = bytes > sp->seen_bytes ? bytes - sp->seen_bytes : sp->chunk_bytes;
	sp->seen_bytes = bytes;
	if (look(sp) == 0 && excess(sp, file, sp->chunk_bytes) == 0) {
		return 0;
	}
	return space_make(sp, file, sp->chunk_bytes);
}

uint64_t space_largest_file(const struct space *sp, const struct record_file *file)
{
	uint64_t all = sp->bytes_kept + record_file_bytes(file) +
		       beyond(sp->bytes_free, sp->opt->reserve_bytes);

	return may_delete(sp) ? all / SPACE_FILES : UINT64_MAX;
}
