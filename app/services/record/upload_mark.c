/* SPDX-License-Identifier: MIT */
#include "record/upload_mark.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "record/file_io.h"

#define HEAD "ecdaq-upload 1\n"

enum { MARK_MODE = 0640, NUMBER_BYTES = 24 };

static const char *const suffixes[] = {
	[UPLOAD_MARK_BEGUN] = ".uploading",
	[UPLOAD_MARK_DONE] = ".uploaded",
};

/* The next line "KEY=VALUE" at *@at to @buf. 0; -EBADMSG: another line, or too long. */
static int take_line(const char **at, const char *end, const char *key, char *buf, size_t buf_len)
{
	size_t key_len = strlen(key);
	const char *line = *at;
	const char *newline = line == end ? NULL : memchr(line, '\n', (size_t)(end - line));
	size_t len;

	if (newline == NULL || (size_t)(newline - line) <= key_len ||
	    memcmp(line, key, key_len) != 0 || line[key_len] != '=') {
		return -EBADMSG;
	}
	line += key_len + 1;
	len = (size_t)(newline - line);
	if (len >= buf_len) {
		return -EBADMSG;
	}
	for (size_t i = 0; i < len; i++) {
		if (line[i] <= ' ' || line[i] > '~') { /* the whole file is printable ASCII */
			return -EBADMSG;
		}
	}
	memcpy(buf, line, len);
	buf[len] = '\0';
	*at = newline + 1;
	return 0;
}

static int take_number(const char **at, const char *end, const char *key, uint64_t *ret)
{
	char text[NUMBER_BYTES];
	char *stop;
	int r = take_line(at, end, key, text, sizeof(text));

	if (r < 0 || text[0] < '0' || text[0] > '9') {
		return -EBADMSG;
	}
	errno = 0;
	*ret = strtoull(text, &stop, 10);
	return *stop == '\0' && errno == 0 ? 0 : -EBADMSG;
}

static int is_sha256(const char *text)
{
	return strlen(text) == UPLOAD_SHA256_CHARS &&
	       strspn(text, "0123456789abcdef") == UPLOAD_SHA256_CHARS;
}

int upload_mark_parse(const char *text, size_t len, struct upload_mark *ret_mark)
{
	struct upload_mark mark = { .bytes = 0 };
	const char *end = text + len;
	const char *at = text + strlen(HEAD);
	uint64_t mtime = 0;
	int r = len < strlen(HEAD) || memcmp(text, HEAD, strlen(HEAD)) != 0 ? -EBADMSG : 0;

	r = r < 0 ? r : take_number(&at, end, "bytes", &mark.bytes);
	r = r < 0 ? r : take_number(&at, end, "mtime_ns", &mtime);
	r = r < 0 ? r : take_line(&at, end, "sha256", mark.sha256, sizeof(mark.sha256));
	r = r < 0 ? r : take_line(&at, end, "key", mark.key, sizeof(mark.key));
	r = r < 0 ? r : take_line(&at, end, "id", mark.id, sizeof(mark.id));
	if (r < 0 || at != end || mtime > INT64_MAX || !is_sha256(mark.sha256) ||
	    mark.key[0] == '\0') {
		return -EBADMSG;
	}
	mark.mtime_ns = (int64_t)mtime;
	*ret_mark = mark;
	return 0;
}

int upload_mark_format(const struct upload_mark *mark, char *buf, size_t buf_len)
{
	struct upload_mark again;
	int n = snprintf(buf, buf_len,
			 HEAD "bytes=%" PRIu64 "\nmtime_ns=%" PRId64 "\nsha256=%s\nkey=%s\nid=%s\n",
			 mark->bytes, mark->mtime_ns, mark->sha256, mark->key, mark->id);

	if (n < 0 || (size_t)n >= buf_len || upload_mark_parse(buf, (size_t)n, &again) < 0) {
		return -EINVAL;
	}
	return n;
}

static int make_path(const char *dir, const char *name, enum upload_mark_kind kind,
		     char path[PATH_MAX])
{
	int n = snprintf(path, PATH_MAX, "%s/%s%s", dir, name, suffixes[kind]);

	return n < 0 || n >= PATH_MAX ? -ENAMETOOLONG : 0;
}

int upload_mark_load(const char *dir, const char *name, enum upload_mark_kind kind,
		     struct upload_mark *ret_mark)
{
	char path[PATH_MAX];
	char text[UPLOAD_MARK_BYTES];
	ssize_t n;
	int fd;
	int r = make_path(dir, name, kind, path);

	if (r < 0) {
		return r;
	}
	fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
	if (fd < 0) {
		return -errno;
	}
	n = read(fd, text, sizeof(text));
	r = n < 0 ? -errno : upload_mark_parse(text, (size_t)n, ret_mark);
	close(fd);
	return r;
}

static int write_synced(const char *path, const char *text, size_t len)
{
	int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, MARK_MODE);
	struct mcap_io io = file_io(&fd);
	int r;

	if (fd < 0) {
		return -errno;
	}
	r = io.write(io.ctx, text, len);
	r = r < 0 ? r : io.sync(io.ctx);
	return close(fd) < 0 && r == 0 ? -errno : r;
}

int upload_mark_save(const char *dir, const char *name, enum upload_mark_kind kind,
		     const struct upload_mark *mark)
{
	char text[UPLOAD_MARK_BYTES];
	char path[PATH_MAX];
	char beside[PATH_MAX];
	int len = upload_mark_format(mark, text, sizeof(text));
	int r = make_path(dir, name, kind, path);

	r = len < 0 ? len : r;
	if (r < 0 || (size_t)snprintf(beside, sizeof(beside), "%s.new", path) >= sizeof(beside)) {
		return r < 0 ? r : -ENAMETOOLONG;
	}
	r = write_synced(beside, text, (size_t)len);
	if (r == 0 && rename(beside, path) < 0) {
		r = -errno;
	}
	if (r < 0) {
		unlink(beside);
		return r;
	}
	r = file_sync_dir(dir);
	/* Both are there after a power cut here; who looks takes the one that is done. */
	return r < 0 || kind != UPLOAD_MARK_DONE ? r
						 : upload_mark_remove(dir, name, UPLOAD_MARK_BEGUN);
}

int upload_mark_remove(const char *dir, const char *name, enum upload_mark_kind kind)
{
	char path[PATH_MAX];
	int r = make_path(dir, name, kind, path);

	return r < 0 ? r : unlink(path) < 0 && errno != ENOENT ? -errno : 0;
}

int upload_mark_is_done(const char *dir, const struct store_entry *entry)
{
	struct upload_mark mark = { .bytes = 0 };

	return upload_mark_load(dir, entry->name, UPLOAD_MARK_DONE, &mark) == 0 &&
	       mark.bytes == entry->bytes;
}

int upload_mark_name(const char *file, char ret_name[STORE_NAME_BYTES],
		     enum upload_mark_kind *ret_kind)
{
	size_t len = strlen(file);

	for (int kind = UPLOAD_MARK_BEGUN; kind <= UPLOAD_MARK_DONE; kind++) {
		size_t tail = strlen(suffixes[kind]);

		if (len > tail && len - tail < STORE_NAME_BYTES &&
		    strcmp(file + len - tail, suffixes[kind]) == 0) {
			snprintf(ret_name, STORE_NAME_BYTES, "%.*s", (int)(len - tail), file);
			*ret_kind = (enum upload_mark_kind)kind;
			return store_is_name(ret_name);
		}
	}
	return 0;
}
