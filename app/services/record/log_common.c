/* SPDX-License-Identifier: MIT */
#include "record/log_common.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "program/exit_code.h"
#include "program/progress.h"
#include "record/store.h"

int log_fail(FILE *err, const char *what, const char *why)
{
	fprintf(err, "ecdaq: log: %s: %s\n", what, why);
	return EXIT_CODE_FAILED;
}

int log_fail_errno(FILE *err, const char *what, int error)
{
	switch (-error) {
	case EPROTO:
		return log_fail(err, what, "not an MCAP file");
	case ENODATA:
		return log_fail(err, what, "ends before its first record, there is nothing in it");
	case EXDEV:
		return log_fail(
			err, what,
			"damaged before its end: use --output FILE to copy the undamaged part");
	case EINVAL:
		return log_fail(err, what, "not a regular file");
	default:
		return log_fail(err, what, strerror(-error));
	}
}

int log_file_open(const char *path, struct log_file *file)
{
	int r;

	file->watch.at = NULL;
	file->fd = open(path, O_RDONLY | O_CLOEXEC);
	if (file->fd < 0) {
		return -errno;
	}
	r = file_source(&file->fd, &file->source);
	if (r < 0) {
		close(file->fd);
	}
	return r;
}

void log_file_watch(struct log_file *file, const char *path)
{
	progress_begin(path, file->source.bytes);
	file_watch(&file->watch, &file->source, progress_at, 0);
}

void log_file_close(struct log_file *file)
{
	if (file->watch.at != NULL) {
		progress_end();
	}
	close(file->fd);
}

int log_part_to_final(char *path)
{
	size_t len = strlen(path);

	if (len < 5 || strcmp(path + len - 5, ".part") != 0) {
		return 0;
	}
	memcpy(path + len - 5, ".mcap", 5);
	return 1;
}

int log_is_recording(const char *path)
{
	char copy[PATH_MAX];

	if (snprintf(copy, sizeof(copy), "%s", path) >= (int)sizeof(copy) ||
	    !log_part_to_final(copy)) {
		return 0;
	}
	return store_is_locked(dirname(copy));
}

void log_format_time(uint64_t utc_ns, char buf[LOG_TIME_BYTES])
{
	time_t s = (time_t)(utc_ns / (uint64_t)NS_PER_S);
	struct tm tm;
	size_t n = 0;

	if (gmtime_r(&s, &tm) != NULL) {
		n = strftime(buf, LOG_TIME_BYTES, "%Y-%m-%dT%H:%M:%S", &tm);
	}
	snprintf(buf + n, LOG_TIME_BYTES - n, ".%03uZ",
		 (unsigned)(utc_ns % (uint64_t)NS_PER_S / (uint64_t)NS_PER_MS));
}

int log_finish_output(FILE *out, FILE *err)
{
	errno = 0;
	if (fflush(out) != 0 || ferror(out)) {
		return log_fail(err, "output", errno != 0 ? strerror(errno) : "write error");
	}
	return EXIT_CODE_OK;
}

const char *log_ending_to_str(enum mcap_ending ending)
{
	switch (ending) {
	case MCAP_ENDING_GOOD:
		return "finished";
	case MCAP_ENDING_MISSING:
		return "not finished";
	case MCAP_ENDING_BAD:
		return "summary damaged";
	}
	return "unknown";
}
