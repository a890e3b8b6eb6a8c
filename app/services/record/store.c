/* SPDX-License-Identifier: MIT */
#include "record/store.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"

#define LOCK_NAME ".ecdaq-record.lock"
#define STATE_NAME ".ecdaq-record.state"
#define STATE_HEAD "ecdaq-record-state 1\n"

enum { LOCK_TRIES = 20, LOCK_PAUSE_MS = 5 };

struct store {
	char dir[PATH_MAX];
	int lock_fd;
};

static int make_dirs(const char *dir)
{
	char path[PATH_MAX];

	if (snprintf(path, sizeof(path), "%s", dir) >= (int)sizeof(path)) {
		return -ENAMETOOLONG;
	}
	for (char *p = path + 1; *p != '\0'; p++) {
		if (*p == '/') {
			*p = '\0';
			if (mkdir(path, 0755) < 0 && errno != EEXIST) {
				return -errno;
			}
			*p = '/';
		}
	}
	return mkdir(path, 0755) < 0 && errno != EEXIST ? -errno : 0;
}

/* Who asks store_is_locked() has the lock for a moment. */
static int try_lock(int fd)
{
	int r = flock(fd, LOCK_EX | LOCK_NB);

	for (int i = 0; i < LOCK_TRIES && r < 0 && errno == EWOULDBLOCK; i++) {
		poll(NULL, 0, LOCK_PAUSE_MS);
		r = flock(fd, LOCK_EX | LOCK_NB);
	}
	return r;
}

static int take_lock(int fd, int64_t *ret_pid)
{
	char text[24];
	ssize_t n;

	if (try_lock(fd) == 0) {
		n = snprintf(text, sizeof(text), "%d\n", (int)getpid());
		/* The number is a help for people; the lock is what counts. */
		if (ftruncate(fd, 0) < 0 || pwrite(fd, text, (size_t)n, 0) != n) {
			return 0;
		}
		return 0;
	}
	if (errno != EWOULDBLOCK) {
		return -errno;
	}
	n = pread(fd, text, sizeof(text) - 1, 0);
	text[n > 0 ? n : 0] = '\0';
	*ret_pid = strtoll(text, NULL, 10);
	return -EBUSY;
}

int store_open(const char *dir, struct store **ret_store, int64_t *ret_pid)
{
	char path[PATH_MAX];
	struct store *s;
	int r = make_dirs(dir);

	if (r < 0) {
		return r;
	}
	r = store_path(dir, LOCK_NAME, path, sizeof(path));
	if (r < 0) {
		return r;
	}
	s = calloc(1, sizeof(*s));
	if (s == NULL) {
		return -ENOMEM;
	}
	snprintf(s->dir, sizeof(s->dir), "%s", dir);
	s->lock_fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0644);
	r = s->lock_fd < 0 ? -errno : take_lock(s->lock_fd, ret_pid);
	if (r < 0) {
		store_close(s);
		return r;
	}
	*ret_store = s;
	return 0;
}

int store_open_or_tell(const char *dir, struct store **ret_store, char *error, size_t error_bytes)
{
	int64_t pid = 0;
	int r = store_open(dir, ret_store, &pid);

	if (r == -EBUSY) {
		snprintf(error, error_bytes,
			 "%s: another ecdaq-record (process %" PRId64 ") records there", dir, pid);
	} else if (r < 0) {
		snprintf(error, error_bytes, "%s: %s", dir, strerror(-r));
	}
	return r;
}

int store_is_locked(const char *dir)
{
	char path[PATH_MAX];
	int is_locked;
	int fd;

	if (store_path(dir, LOCK_NAME, path, sizeof(path)) < 0) {
		return 0;
	}
	fd = open(path, O_RDONLY | O_CLOEXEC);
	if (fd < 0) {
		return 0;
	}
	is_locked = flock(fd, LOCK_SH | LOCK_NB) < 0 && errno == EWOULDBLOCK;
	close(fd);
	return is_locked;
}

void store_close(struct store *s)
{
	if (s == NULL) {
		return;
	}
	if (s->lock_fd >= 0) {
		close(s->lock_fd);
	}
	free(s);
}

const char *store_dir(const struct store *s)
{
	return s->dir;
}

int store_path(const char *dir, const char *name, char *buf, size_t buf_len)
{
	return snprintf(buf, buf_len, "%s/%s", dir, name) >= (int)buf_len ? -ENAMETOOLONG : 0;
}

/* Its milliseconds: two runs of the master differ in them. */
static uint32_t name_of_session(uint64_t session)
{
	return (uint32_t)(session / (uint64_t)NS_PER_MS);
}

void store_make_name(char buf[STORE_NAME_BYTES], int64_t utc_ns, uint64_t session,
		     uint64_t sequence)
{
	time_t s = (time_t)(utc_ns / NS_PER_S);
	struct tm tm;
	char when[32];

	if (gmtime_r(&s, &tm) == NULL || strftime(when, sizeof(when), "%Y%m%dT%H%M%SZ", &tm) == 0) {
		snprintf(when, sizeof(when), "unknown");
	}
	snprintf(buf, STORE_NAME_BYTES, "ecdaq-%s-%08" PRIx32 "-%06" PRIu64, when,
		 name_of_session(session), sequence);
}

int store_name_is_of(const char *name, uint64_t session)
{
	char part[16];

	snprintf(part, sizeof(part), "-%08" PRIx32 "-", name_of_session(session));
	return strstr(name, part) != NULL;
}

int store_parse_name(const char *name, uint64_t *ret_sequence, int *ret_is_part)
{
	const char *suffix = strrchr(name, '.');
	const char *dash = strrchr(name, '-');
	uint64_t sequence;
	char *end;

	if (strncmp(name, "ecdaq-", 6) != 0 || suffix == NULL || dash == NULL || dash > suffix ||
	    strlen(name) >= STORE_NAME_BYTES ||
	    (strcmp(suffix, ".mcap") != 0 && strcmp(suffix, ".part") != 0)) {
		return 0;
	}
	if (dash[1] < '0' || dash[1] > '9') {
		return 0;
	}
	errno = 0;
	sequence = strtoull(dash + 1, &end, 10);
	if (end != suffix || errno != 0) {
		return 0;
	}
	*ret_sequence = sequence;
	*ret_is_part = strcmp(suffix, ".part") == 0;
	return 1;
}

static int by_sequence(const void *a, const void *b)
{
	const struct store_entry *x = a;
	const struct store_entry *y = b;

	if (x->sequence != y->sequence) {
		return x->sequence < y->sequence ? -1 : 1;
	}
	return strcmp(x->name, y->name);
}

static int append_entry(struct store_entry **entries, size_t *count, const struct store_entry *e)
{
	struct store_entry *grown;

	if ((*count & (*count - 1)) == 0) { /* full at each power of two */
		grown = realloc(*entries, (*count == 0 ? 1 : *count * 2) * sizeof(*grown));
		if (grown == NULL) {
			return -ENOMEM;
		}
		*entries = grown;
	}
	(*entries)[(*count)++] = *e;
	return 0;
}

/* NAME.damaged is what NAME.part was. */
static int parse_any_name(const char *name, struct store_entry *e)
{
	static const char damaged[] = ".damaged";
	char part[STORE_NAME_BYTES];
	size_t len = strlen(name);

	if (len < sizeof(damaged) || len >= sizeof(part) ||
	    strcmp(name + len - strlen(damaged), damaged) != 0) {
		return store_parse_name(name, &e->sequence, &e->is_part);
	}
	snprintf(part, sizeof(part), "%.*s.mcap", (int)(len - strlen(damaged)), name);
	return store_parse_name(part, &e->sequence, &e->is_part);
}

int store_is_name(const char *name)
{
	struct store_entry e;

	for (const char *p = name; *p != '\0'; p++) {
		if (!((*p >= 'a' && *p <= 'z') || (*p >= 'A' && *p <= 'Z') ||
		      (*p >= '0' && *p <= '9') || *p == '-' || *p == '.')) {
			return 0;
		}
	}
	return parse_any_name(name, &e);
}

int64_t store_name_utc_s(const char *name)
{
	struct tm tm = { .tm_sec = 0 };
	const char *end =
		strncmp(name, "ecdaq-", 6) == 0 ? strptime(name + 6, "%Y%m%dT%H%M%SZ", &tm) : NULL;

	return end == NULL || *end != '-' ? 0 : (int64_t)timegm(&tm);
}

/* NAME.keep, with or without the suffix of the recording in NAME. */
static int has_pin(int dir_fd, const char *name)
{
	int stem = (int)(strrchr(name, '.') - name);
	char pin[STORE_NAME_BYTES + 8];

	snprintf(pin, sizeof(pin), "%.*s.keep", stem, name);
	if (faccessat(dir_fd, pin, F_OK, AT_SYMLINK_NOFOLLOW) == 0) {
		return 1;
	}
	snprintf(pin, sizeof(pin), "%s.keep", name);
	return faccessat(dir_fd, pin, F_OK, AT_SYMLINK_NOFOLLOW) == 0;
}

static int list(const char *dir, int is_all, struct store_entry **ret_entries, size_t *ret_count)
{
	struct store_entry *entries = NULL;
	size_t count = 0;
	struct dirent *d;
	DIR *stream = opendir(dir);
	int fd = stream != NULL ? dirfd(stream) : -1;
	int r = 0;

	if (fd < 0) {
		return -errno;
	}
	while (r == 0 && (d = readdir(stream)) != NULL) {
		struct store_entry e = { .sequence = 0 };
		struct stat st;

		if (!(is_all ? parse_any_name(d->d_name, &e)
			     : store_parse_name(d->d_name, &e.sequence, &e.is_part)) ||
		    fstatat(fd, d->d_name, &st, AT_SYMLINK_NOFOLLOW) < 0 || !S_ISREG(st.st_mode)) {
			continue;
		}
		memcpy(e.name, d->d_name, strlen(d->d_name) + 1); /* its length was checked */
		e.bytes = (uint64_t)st.st_size;
		e.is_pinned = is_all && has_pin(fd, e.name);
		r = append_entry(&entries, &count, &e);
	}
	closedir(stream);
	if (r < 0) {
		free(entries);
		return r;
	}
	if (count > 1) {
		qsort(entries, count, sizeof(entries[0]), by_sequence);
	}
	*ret_entries = entries;
	*ret_count = count;
	return 0;
}

int store_list(const char *dir, struct store_entry **ret_entries, size_t *ret_count)
{
	return list(dir, 0, ret_entries, ret_count);
}

int store_list_all(const char *dir, struct store_entry **ret_entries, size_t *ret_count)
{
	return list(dir, 1, ret_entries, ret_count);
}

/* The state file's lines, and where each goes. */
static const struct {
	const char *key;
	size_t offset;
} state_fields[] = {
	{ "session", offsetof(struct store_state, session) },
	{ "next_cycle", offsetof(struct store_state, next_cycle) },
	{ "first_cycle", offsetof(struct store_state, first_cycle) },
	{ "cycles", offsetof(struct store_state, cycles) },
	{ "gaps", offsetof(struct store_state, gaps) },
	{ "missing", offsetof(struct store_state, missing) },
	{ "event_next", offsetof(struct store_state, event_next) },
	{ "event_mono_ns", offsetof(struct store_state, event_mono_ns) },
	{ "sequence", offsetof(struct store_state, sequence) },
	{ "sync0_next", offsetof(struct store_state, sync0_next) },
	{ "sync0_mono_ns", offsetof(struct store_state, sync0_mono_ns) },
	{ "sync0_event_next", offsetof(struct store_state, sync0_event_next) },
	{ "sync0_event_mono_ns", offsetof(struct store_state, sync0_event_mono_ns) },
};

/* The first so many were always there; a file without the rest is from before ecdaq-sync0. */
enum { STATE_FIELDS = sizeof(state_fields) / sizeof(state_fields[0]), STATE_FIELDS_OLD = 9 };

/* "key=number"; each field must come in its place. */
static int parse_state_line(const char *line, size_t field, struct store_state *state)
{
	size_t len = strlen(state_fields[field].key);
	uint64_t value;
	char *end;

	if (strncmp(line, state_fields[field].key, len) != 0 || line[len] != '=') {
		return -EBADMSG;
	}
	errno = 0;
	value = strtoull(line + len + 1, &end, 10);
	if (end == line + len + 1 || *end != '\n' || errno != 0) {
		return -EBADMSG;
	}
	memcpy((char *)state + state_fields[field].offset, &value, sizeof(value));
	return 0;
}

int store_load_state(const struct store *s, struct store_state *ret_state)
{
	struct store_state state = { .session = 0 };
	char path[PATH_MAX];
	char line[80];
	FILE *in;
	int r = 0;

	if (store_path(s->dir, STATE_NAME, path, sizeof(path)) < 0) {
		return -ENAMETOOLONG;
	}
	in = fopen(path, "re");
	if (in == NULL) {
		return -errno;
	}
	if (fgets(line, sizeof(line), in) == NULL || strcmp(line, STATE_HEAD) != 0) {
		r = -EBADMSG;
	}
	for (size_t i = 0; i < STATE_FIELDS && r == 0; i++) {
		if (fgets(line, sizeof(line), in) == NULL) {
			r = i == STATE_FIELDS_OLD ? 0 : -EBADMSG;
			break;
		}
		r = parse_state_line(line, i, &state);
	}
	fclose(in);
	if (r == 0) {
		*ret_state = state;
	}
	return r;
}

int store_save_state(const struct store *s, const struct store_state *state)
{
	char path[PATH_MAX];
	char temporary[PATH_MAX];
	FILE *out;
	int r;

	if (store_path(s->dir, STATE_NAME, path, sizeof(path)) < 0 ||
	    store_path(s->dir, STATE_NAME ".new", temporary, sizeof(temporary)) < 0) {
		return -ENAMETOOLONG;
	}
	out = fopen(temporary, "we");
	if (out == NULL) {
		return -errno;
	}
	fputs(STATE_HEAD, out);
	for (size_t i = 0; i < STATE_FIELDS; i++) {
		uint64_t value;

		memcpy(&value, (const char *)state + state_fields[i].offset, sizeof(value));
		fprintf(out, "%s=%" PRIu64 "\n", state_fields[i].key, value);
	}
	errno = 0;
	r = ferror(out) || fflush(out) != 0 ? -(errno != 0 ? errno : EIO) : 0;
	if (fclose(out) != 0 && r == 0) {
		r = -errno;
	}
	if (r == 0 && rename(temporary, path) < 0) {
		r = -errno;
	}
	if (r < 0) {
		unlink(temporary);
	}
	return r;
}
