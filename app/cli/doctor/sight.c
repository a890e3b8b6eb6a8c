/* SPDX-License-Identifier: MIT */
#include "cli/doctor/sight.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int path_of(const struct sight *s, char path[SIGHT_PATH_BYTES], const char *format,
		   va_list args) __attribute__((format(printf, 3, 0)));

static int path_of(const struct sight *s, char path[SIGHT_PATH_BYTES], const char *format,
		   va_list args)
{
	int used = snprintf(path, SIGHT_PATH_BYTES, "%s", s->root);
	int more;

	if (used < 0 || used >= SIGHT_PATH_BYTES) {
		return -ENAMETOOLONG;
	}
	more = vsnprintf(path + used, (size_t)(SIGHT_PATH_BYTES - used), format, args);
	return more < 0 || more >= SIGHT_PATH_BYTES - used ? -ENAMETOOLONG : 0;
}

static int open_path(const char *path)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

	return fd < 0 ? -errno : fd;
}

static int read_text(const char *path, char ret_text[SIGHT_TEXT_BYTES])
{
	char text[SIGHT_TEXT_BYTES];
	int fd = open_path(path);
	ssize_t len;

	if (fd < 0) {
		return fd;
	}
	len = read(fd, text, sizeof(text) - 1);
	if (len < 0) {
		int r = -errno;

		close(fd);
		return r;
	}
	close(fd);
	while (len > 0 && (unsigned char)text[len - 1] <= ' ') {
		len--;
	}
	text[len] = '\0';
	memcpy(ret_text, text, (size_t)len + 1);
	return (int)len;
}

int sight_text(const struct sight *s, char ret_text[SIGHT_TEXT_BYTES], const char *format, ...)
{
	char path[SIGHT_PATH_BYTES];
	va_list args;
	int r;

	va_start(args, format);
	r = path_of(s, path, format, args);
	va_end(args);
	return r < 0 ? r : read_text(path, ret_text);
}

int sight_number(const struct sight *s, int64_t *ret, const char *format, ...)
{
	char text[SIGHT_TEXT_BYTES];
	char path[SIGHT_PATH_BYTES];
	long long value;
	va_list args;
	char *end;
	int r;

	va_start(args, format);
	r = path_of(s, path, format, args);
	va_end(args);
	if (r == 0) {
		r = read_text(path, text);
	}
	if (r < 0) {
		return r;
	}
	errno = 0;
	value = strtoll(text, &end, 10);
	if (errno != 0 || end == text || *end != '\0') {
		return -EBADMSG;
	}
	*ret = value;
	return 0;
}

int sight_link(const struct sight *s, char ret_text[SIGHT_TEXT_BYTES], const char *format, ...)
{
	char path[SIGHT_PATH_BYTES];
	char target[SIGHT_PATH_BYTES];
	const char *name;
	va_list args;
	ssize_t len;
	int r;

	va_start(args, format);
	r = path_of(s, path, format, args);
	va_end(args);
	if (r < 0) {
		return r;
	}
	len = readlink(path, target, sizeof(target) - 1);
	if (len < 0) {
		return -errno;
	}
	target[len] = '\0';
	name = strrchr(target, '/');
	return snprintf(ret_text, SIGHT_TEXT_BYTES, "%s", name == NULL ? target : name + 1);
}

int sight_exists(const struct sight *s, const char *format, ...)
{
	char path[SIGHT_PATH_BYTES];
	va_list args;
	int r;

	va_start(args, format);
	r = path_of(s, path, format, args);
	va_end(args);
	return r == 0 && access(path, F_OK) == 0;
}

FILE *sight_open(const struct sight *s, const char *format, ...)
{
	char path[SIGHT_PATH_BYTES];
	va_list args;
	FILE *file;
	int fd;
	int r;

	va_start(args, format);
	r = path_of(s, path, format, args);
	va_end(args);
	fd = r < 0 ? r : open_path(path);
	if (fd < 0) {
		errno = -fd;
		return NULL;
	}
	file = fdopen(fd, "r");
	if (file == NULL) {
		close(fd);
	}
	return file;
}

int sight_path(const struct sight *s, char ret_path[SIGHT_PATH_BYTES], const char *format, ...)
{
	char path[SIGHT_PATH_BYTES];
	va_list args;
	int r;

	va_start(args, format);
	r = path_of(s, path, format, args);
	va_end(args);
	if (r == 0) {
		memcpy(ret_path, path, sizeof(path));
	}
	return r;
}

int sight_each(const struct sight *s, const char *dir, void (*each)(void *ctx, const char *name),
	       void *ctx)
{
	char path[SIGHT_PATH_BYTES];
	const struct dirent *entry;
	int r = sight_path(s, path, "%s", dir);
	DIR *open_dir;

	if (r < 0) {
		return r;
	}
	open_dir = opendir(path);
	if (open_dir == NULL) {
		return -errno;
	}
	while ((entry = readdir(open_dir)) != NULL) {
		if (entry->d_name[0] != '.') {
			each(ctx, entry->d_name);
		}
	}
	closedir(open_dir);
	return 0;
}
