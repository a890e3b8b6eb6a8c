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
#include "record/upload_mark.h"

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
struct excess {
	uint64_t of_budget;
	uint64_t of_disk;
};

static struct excess find_excess(const struct space *sp, const struct record_file *file,
				 uint64_t more)
{
	const struct recorder_options *opt = sp->opt;
	uint64_t open_bytes = file != NULL ? record_file_final_bytes(file) + SPACE_END_BYTES : 0;
	uint64_t written = file != NULL ? record_file_bytes(file) : 0;
	uint64_t wanted = opt->reserve_bytes + more + (open_bytes - written);
	/* A small budget has no use for the margin of a large disk. */
	uint64_t more_of_budget = more < opt->budget_bytes / 8 ? more : opt->budget_bytes / 8;
	struct excess e = { .of_disk = beyond(wanted, sp->bytes_free) };

	if (opt->budget_bytes > 0) {
		e.of_budget =
			beyond(sp->bytes_kept + open_bytes + more_of_budget, opt->budget_bytes);
	}
	return e;
}

static uint64_t larger(uint64_t a, uint64_t b)
{
	return a > b ? a : b;
}

static int may_delete(const struct space *sp)
{
	return sp->opt->when_full == CONFIG_WHEN_FULL_OLDEST && sp->opt->budget_bytes > 0;
}

/* 1 if it waits for ecdaq-uplink, which sends no damaged one. */
static int is_kept_back(const struct space *sp, const struct store_entry *entry)
{
	const struct recorder_options *opt = sp->opt;
	const char *suffix = strrchr(entry->name, '.');

	return opt->marks_dir != NULL && opt->marks_dir[0] != '\0' &&
	       opt->keep_until_uploaded != CONFIG_KEEP_NEVER && suffix != NULL &&
	       strcmp(suffix, ".mcap") == 0 && !upload_mark_is_done(opt->marks_dir, entry);
}

/* What could be deleted: of what is uploaded, or need not be, and of the rest. */
struct deletable {
	uint64_t bytes;
	uint64_t kept_back;
};

static struct deletable mark_kept_back(const struct space *sp, struct store_entry *entry,
				       size_t count)
{
	struct deletable d = { .bytes = 0 };

	for (size_t i = 0; i < count; i++) {
		if (entry[i].is_part || entry[i].is_pinned) {
			continue;
		}
		entry[i].is_kept_back = is_kept_back(sp, &entry[i]);
		*(entry[i].is_kept_back ? &d.kept_back : &d.bytes) += entry[i].bytes;
	}
	return d;
}

static uint64_t wanted_of(enum config_keep keep, const struct excess *e, int is_kept_back)
{
	if (!is_kept_back) {
		return larger(e->of_budget, e->of_disk);
	}
	return keep == CONFIG_KEEP_UNTIL_FULL ? e->of_disk : 0;
}

/* Those of one kind, the oldest first, as long as too much is there. */
static int delete_kind(struct space *sp, const struct record_file *file, uint64_t more,
		       const struct store_entry *entry, size_t count, int is_kept_back)
{
	enum config_keep keep = sp->opt->keep_until_uploaded;
	struct excess e = find_excess(sp, file, more);
	char path[PATH_MAX];
	int r = 0;

	for (size_t i = 0; i < count && r == 0 && wanted_of(keep, &e, is_kept_back) > 0; i++) {
		if (entry[i].is_part || entry[i].is_pinned ||
		    entry[i].is_kept_back != is_kept_back ||
		    store_path(sp->opt->dir, entry[i].name, path, sizeof(path)) < 0 ||
		    unlink(path) < 0) {
			continue;
		}
		sp->bytes_kept -= entry[i].bytes;
		r = look(sp);
		e = find_excess(sp, file, more);
	}
	return r;
}

/* What is not uploaded may be beyond the budget, not on the disk's reserve. */
static int has_room(struct space *sp, const struct excess *e, uint64_t kept_back)
{
	sp->bytes_kept_back = e->of_budget > 0 ? kept_back : 0;
	return e->of_disk == 0 && e->of_budget <= kept_back;
}

static int delete_oldest(struct space *sp, const struct record_file *file, uint64_t more,
			 struct store_entry *entry, size_t count)
{
	struct deletable d = mark_kept_back(sp, entry, count);
	struct excess e = find_excess(sp, file, more);
	uint64_t of_kept_back =
		sp->opt->keep_until_uploaded == CONFIG_KEEP_UNTIL_FULL ? d.kept_back : 0;
	uint64_t before;
	int r;

	if (!may_delete(sp) ||
	    d.bytes < larger(beyond(e.of_budget, d.kept_back), beyond(e.of_disk, of_kept_back))) {
		return -ENOSPC;
	}
	r = delete_kind(sp, file, more, entry, count, 0);
	before = sp->bytes_kept;
	r = r < 0 ? r : delete_kind(sp, file, more, entry, count, 1);
	e = find_excess(sp, file, more);
	return r < 0                                                            ? r
	       : has_room(sp, &e, beyond(d.kept_back, before - sp->bytes_kept)) ? 0
										: -ENOSPC;
}

int space_make(struct space *sp, const struct record_file *file, uint64_t more)
{
	const char *open_path = file != NULL ? record_file_path(file) : "";
	struct store_entry *entry = NULL;
	struct excess e;
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
	sp->bytes_kept_back = 0;
	e = find_excess(sp, file, more);
	r = larger(e.of_budget, e.of_disk) > 0 ? delete_oldest(sp, file, more, entry, count) : 0;
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
	if (look(sp) == 0) {
		struct excess e = find_excess(sp, file, sp->chunk_bytes);

		if (e.of_disk == 0 && e.of_budget <= sp->bytes_kept_back) {
			return 0;
		}
	}
	return space_make(sp, file, sp->chunk_bytes);
}

uint64_t space_largest_file(const struct space *sp, const struct record_file *file)
{
	uint64_t all = sp->bytes_kept + record_file_bytes(file) +
		       beyond(sp->bytes_free, sp->opt->reserve_bytes);

	return may_delete(sp) ? all / SPACE_FILES : UINT64_MAX;
}
