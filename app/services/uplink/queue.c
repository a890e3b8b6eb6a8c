/* SPDX-License-Identifier: MIT */
#include "uplink/queue.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "record/upload_mark.h"

static int compare(const struct store_entry *a, const struct store_entry *b)
{
	return a->sequence != b->sequence ? (a->sequence < b->sequence ? -1 : 1)
					  : strcmp(a->name, b->name);
}

/* By its mark, and the mark is of this file. */
static int is_uploaded(const char *record_dir, const char *marks_dir,
		       const struct store_entry *entry)
{
	char path[PATH_MAX];
	struct upload_mark mark;
	struct stat st;

	if (upload_mark_load(marks_dir, entry->name, UPLOAD_MARK_DONE, &mark) < 0) {
		return 0;
	}
	if (mark.bytes == entry->bytes &&
	    store_path(record_dir, entry->name, path, sizeof(path)) == 0 && stat(path, &st) == 0 &&
	    (int64_t)st.st_mtim.tv_sec * NS_PER_S + st.st_mtim.tv_nsec == mark.mtime_ns) {
		return 1;
	}
	/* Another recording of this name: the recorder must not take it for uploaded. */
	(void)upload_mark_remove(marks_dir, entry->name, UPLOAD_MARK_DONE);
	return 0;
}

int queue_update(struct queue *q, const char *record_dir, const char *marks_dir,
		 void (*lost)(void *ctx, const struct queue_item *item), void *ctx)
{
	struct store_entry *entry = NULL;
	struct queue_item *item;
	size_t listed = 0;
	size_t count = 0;
	size_t old = 0;
	int r = store_list(record_dir, &entry, &listed);

	item = r < 0 ? NULL : calloc(listed > 0 ? listed : 1, sizeof(*item));
	if (item == NULL) {
		free(entry);
		return r < 0 ? r : -ENOMEM;
	}
	for (size_t i = 0; i < listed; i++) {
		if (entry[i].is_part) {
			continue;
		}
		for (; old < q->count && compare(&q->item[old].entry, &entry[i]) < 0; old++) {
			lost(ctx, &q->item[old]);
		}
		if (old < q->count && compare(&q->item[old].entry, &entry[i]) == 0 &&
		    q->item[old].entry.bytes == entry[i].bytes) {
			item[count++] = q->item[old++];
			continue;
		}
		old += old < q->count && compare(&q->item[old].entry, &entry[i]) == 0;
		item[count].entry = entry[i];
		item[count++].is_uploaded = is_uploaded(record_dir, marks_dir, &entry[i]);
	}
	for (; old < q->count; old++) {
		lost(ctx, &q->item[old]);
	}
	free(entry);
	free(q->item);
	q->item = item;
	q->count = count;
	return 0;
}

void queue_done(struct queue *q)
{
	free(q->item);
	*q = (struct queue){ .item = NULL };
}

struct queue_item *queue_next(struct queue *q, int64_t now_ns)
{
	for (size_t i = 0; i < q->count; i++) {
		if (!q->item[i].is_uploaded && q->item[i].not_before_ns <= now_ns) {
			return &q->item[i];
		}
	}
	return NULL;
}

static int compare_item(const void *key, const void *item)
{
	return compare(key, &((const struct queue_item *)item)->entry);
}

struct queue_item *queue_find(struct queue *q, const char *name)
{
	struct store_entry wanted = { .sequence = 0 };
	size_t len = strlen(name);

	if (len >= sizeof(wanted.name) ||
	    !store_parse_name(name, &wanted.sequence, &wanted.is_part)) {
		return NULL;
	}
	memcpy(wanted.name, name, len + 1);
	return q->count == 0
		       ? NULL
		       : bsearch(&wanted, q->item, q->count, sizeof(q->item[0]), compare_item);
}

int queue_find_leftover(struct queue *q, const char *marks_dir, char ret_name[STORE_NAME_BYTES])
{
	DIR *stream = opendir(marks_dir);
	struct dirent *d;
	int is_found = 0;

	while (stream != NULL && !is_found && (d = readdir(stream)) != NULL) {
		enum upload_mark_kind kind;

		is_found = upload_mark_name(d->d_name, ret_name, &kind) &&
			   queue_find(q, ret_name) == NULL;
	}
	if (stream != NULL) {
		closedir(stream);
	}
	return is_found;
}
