/* SPDX-License-Identifier: MIT */
#include "web/recordings.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "record/file_io.h"
#include "record/overview.h"
#include "record/store.h"
#include "web/text.h"

enum { READS_PER_POLL = 16 };
#define LIST_NS (2 * NS_PER_S)

enum item_read { ITEM_UNREAD, ITEM_GOOD, ITEM_WITHOUT_END, ITEM_FAILED };

struct item {
	struct store_entry entry;
	enum item_read read;
	struct overview overview; /* of ITEM_GOOD */
};

struct recordings {
	const char *dir;
	struct item *item; /* the newest ones, in order of their sequence */
	size_t count;
	size_t total; /* with those that are not in item */
	uint64_t total_bytes;
	int error; /* of reading the folder */
	int is_locked;
	int has_list;
	int64_t listed_ns;
	char *text;
	uint64_t number;
};

int recordings_create(const char *dir, struct recordings **ret_recordings)
{
	struct recordings *r = calloc(1, sizeof(*r));

	if (r == NULL) {
		return -ENOMEM;
	}
	r->dir = dir;
	*ret_recordings = r;
	return 0;
}

void recordings_destroy(struct recordings *r)
{
	if (r != NULL) {
		free(r->item);
		free(r->text);
		free(r);
	}
}

int recordings_open(const char *dir, const char *name, uint64_t *ret_bytes)
{
	char path[PATH_MAX];
	struct stat st;
	int fd;

	if (!store_is_name(name) || store_path(dir, name, path, sizeof(path)) < 0) {
		return -ENOENT;
	}
	/* Without O_NONBLOCK the opening of a FIFO would wait for its writer. */
	fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
	if (fd < 0) {
		return errno == ELOOP ? -ENOENT : -errno;
	}
	if (fstat(fd, &st) < 0 || !S_ISREG(st.st_mode)) {
		close(fd);
		return -ENOENT;
	}
	*ret_bytes = (uint64_t)st.st_size;
	return fd;
}

/* What was read of the same file before. */
static void take_known(const struct recordings *r, struct item *item)
{
	for (size_t i = 0; i < r->count; i++) {
		const struct item *known = &r->item[i];

		if (known->entry.bytes == item->entry.bytes &&
		    strcmp(known->entry.name, item->entry.name) == 0) {
			item->read = known->read;
			item->overview = known->overview;
			return;
		}
	}
}

static void list_folder(struct recordings *r)
{
	struct store_entry *entries = NULL;
	size_t count = 0;
	size_t first;
	struct item *item;

	r->error = store_list_all(r->dir, &entries, &count);
	r->is_locked = store_is_locked(r->dir);
	first = count > RECORDINGS_LISTED ? count - RECORDINGS_LISTED : 0;
	item = calloc(count - first + 1, sizeof(*item));
	if (item == NULL) {
		free(entries);
		r->error = -ENOMEM;
		return;
	}
	r->total = count;
	r->total_bytes = 0;
	for (size_t i = 0; i < count; i++) {
		r->total_bytes += entries[i].bytes;
		if (i >= first) {
			item[i - first].entry = entries[i];
			take_known(r, &item[i - first]);
		}
	}
	free(entries);
	free(r->item);
	r->item = item;
	r->count = count - first;
	r->has_list = 1;
}

static void read_item(const struct recordings *r, struct item *item)
{
	struct mcap_source source;
	uint64_t bytes;
	int fd = recordings_open(r->dir, item->entry.name, &bytes);
	int result = fd;

	if (fd >= 0) {
		result = file_source(&fd, &source);
		result = result < 0 ? result : overview_read(&source, &item->overview);
		close(fd);
	}
	item->read = result == 0 ? ITEM_GOOD : result == -ENODATA ? ITEM_WITHOUT_END : ITEM_FAILED;
}

/* The newest first: those are looked at. 1: something was read. */
static int read_items(struct recordings *r)
{
	int done = 0;

	for (size_t i = r->count; i > 0 && done < READS_PER_POLL; i--) {
		if (r->item[i - 1].read == ITEM_UNREAD) {
			read_item(r, &r->item[i - 1]);
			done++;
		}
	}
	return done > 0;
}

static int ends_with(const char *name, const char *suffix)
{
	size_t len = strlen(name);

	return len >= strlen(suffix) && strcmp(name + len - strlen(suffix), suffix) == 0;
}

static const char *state_of(const struct recordings *r, size_t i)
{
	const struct item *item = &r->item[i];

	if (ends_with(item->entry.name, ".damaged")) {
		return "damaged";
	}
	if (item->entry.is_part) {
		/* One recorder, one open file: the newest. */
		return r->is_locked && i + 1 == r->count ? "recording" : "unfinished";
	}
	switch (item->read) {
	case ITEM_UNREAD:
	case ITEM_GOOD:
		return "finished";
	case ITEM_WITHOUT_END:
		return "damaged";
	case ITEM_FAILED:
		break;
	}
	return "unreadable";
}

static void put_item(struct json *js, const struct recordings *r, size_t i)
{
	const struct item *item = &r->item[i];
	const struct overview *found = item->read == ITEM_GOOD ? &item->overview : NULL;
	int64_t named_s = store_name_utc_s(item->entry.name);

	json_object_begin(js, NULL);
	json_text(js, "name", item->entry.name);
	json_u64(js, "bytes", item->entry.bytes);
	json_text(js, "state", state_of(r, i));
	json_truth(js, "kept", item->entry.is_pinned);
	if (found != NULL && found->start_ns > 0) {
		json_fixed(js, "start_ms", (double)found->start_ns / 1e6, 3);
	} else if (named_s != 0) {
		json_i64(js, "start_ms", named_s * 1000);
	}
	if (found != NULL && found->end_ns >= found->start_ns) {
		json_fixed(js, "seconds", (double)(found->end_ns - found->start_ns) / 1e9, 3);
	}
	if (found != NULL && found->has_counts) {
		json_u64(js, "cycles", found->cycles);
		json_u64(js, "missing", found->missing);
	}
	json_object_end(js);
}

static char *make_text(const struct recordings *r)
{
	struct text t;

	if (text_begin(&t, "recordings") < 0) {
		return NULL;
	}
	json_text(&t.json, "dir", r->dir);
	json_text(&t.json, "error", r->error < 0 ? strerror(-r->error) : "");
	json_u64(&t.json, "total", r->total);
	json_u64(&t.json, "bytes", r->total_bytes);
	json_array_begin(&t.json, "recordings");
	for (size_t i = r->count; i > 0; i--) {
		put_item(&t.json, r, i - 1);
	}
	json_array_end(&t.json);
	return text_end(&t);
}

void recordings_poll(struct recordings *r, int64_t now_ns)
{
	int is_new = 0;
	char *text;

	if (!r->has_list || now_ns - r->listed_ns >= LIST_NS) {
		r->listed_ns = now_ns;
		list_folder(r);
		is_new = 1;
	}
	is_new |= read_items(r);
	text = is_new ? make_text(r) : NULL;
	if (text != NULL && (r->text == NULL || strcmp(text, r->text) != 0)) {
		free(r->text);
		r->text = text;
		r->number++;
		return;
	}
	free(text);
}

const char *recordings_text(const struct recordings *r)
{
	return r->text;
}

uint64_t recordings_number(const struct recordings *r)
{
	return r->number;
}
