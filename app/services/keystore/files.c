/* SPDX-License-Identifier: MIT */
#include "keystore/files.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "keystore/store_layout.h"

enum { DIR_MODE = 0700, FILE_MODE = 0600 };

int files_fail(char *error, int code, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(error, KEYSTORE_ERROR_BYTES, format, args);
	va_end(args);
	return code;
}

int files_path(const char *dir, const char *name, char *ret_path, char *error)
{
	int len = snprintf(ret_path, FILES_PATH_BYTES, "%s/%s", dir, name);

	return len < 0 || len >= FILES_PATH_BYTES
		       ? files_fail(error, -ENAMETOOLONG, "%.100s...: path too long", dir)
		       : 0;
}

int files_make_dir(const char *path, char *error)
{
	if (mkdir(path, DIR_MODE) < 0) {
		return files_fail(error, -errno, "%s: %s", path, strerror(errno));
	}
	/* Whatever the umask is. */
	if (chmod(path, DIR_MODE) < 0) {
		return files_fail(error, -errno, "%s: %s", path, strerror(errno));
	}
	return 0;
}

static int write_all(int fd, const char *data, size_t bytes)
{
	while (bytes > 0) {
		ssize_t n = write(fd, data, bytes);

		if (n < 0 && errno != EINTR) {
			return -errno;
		}
		if (n > 0) {
			data += n;
			bytes -= (size_t)n;
		}
	}
	return fchmod(fd, FILE_MODE) < 0 || fsync(fd) < 0 ? -errno : 0;
}

int files_write(const char *dir, const char *name, const void *data, size_t bytes, char *error)
{
	char path[FILES_PATH_BYTES];
	int r = files_path(dir, name, path, error);
	int fd;

	if (r < 0) {
		return r;
	}
	fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, FILE_MODE);
	r = fd < 0 ? -errno : write_all(fd, data, bytes);
	if (fd >= 0 && close(fd) < 0 && r == 0) {
		r = -errno;
	}
	return r < 0 ? files_fail(error, r, "%s: %s", path, strerror(-r)) : 0;
}

/* Read at most @bytes of the file at @path. Returns the bytes read, or -errno. */
static ssize_t read_start(const char *path, char *data, size_t bytes)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC);
	ssize_t n = fd < 0 ? -1 : read(fd, data, bytes);
	int err = errno;

	if (fd >= 0) {
		close(fd);
	}
	return n < 0 ? -err : n;
}

int files_read(const char *dir, const char *name, char **ret_data, size_t *ret_bytes, char *error)
{
	char path[FILES_PATH_BYTES];
	char *data;
	ssize_t n;
	int r = files_path(dir, name, path, error);

	if (r < 0) {
		return r;
	}
	data = malloc(FILES_TEXT_BYTES);
	n = data == NULL ? -ENOMEM : read_start(path, data, FILES_TEXT_BYTES - 1);
	if (n == FILES_TEXT_BYTES - 1) {
		n = -EFBIG;
	}
	if (n < 0) {
		free(data);
		return files_fail(error, (int)n, "%s: %s", path, strerror((int)-n));
	}
	data[n] = '\0';
	*ret_data = data;
	*ret_bytes = (size_t)n;
	return 0;
}
