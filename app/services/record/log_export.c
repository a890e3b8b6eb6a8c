/* SPDX-License-Identifier: MIT */
/* ecdaq log export */
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/host_clock.h"
#include "program/exit_code.h"
#include "program/progress.h"
#include "record/columns.h"
#include "record/log.h"
#include "record/log_common.h"
#include "record/store.h"

struct export {
	const struct log_export_options *options;
	struct columns *first; /* of the first file: as the header describes it */
	FILE *out;
	FILE *err;
	uint64_t rows;
	int is_hopeless; /* the table cannot be made: no more files */
};

static int is_asked_for(const struct export *ex, uint64_t cycle)
{
	return cycle >= ex->options->from && cycle <= ex->options->to;
}

static void put_row(struct export *ex, const struct columns *c)
{
	if (columns_has_row(c) && is_asked_for(ex, columns_row_cycle(c))) {
		columns_put_row(c, ex->out);
		ex->rows++;
	}
}

/* All channels are known: they must be as the header describes it. */
static int freeze(struct export *ex, struct columns *c, const char *path)
{
	char missing[256];
	char why[320];
	int r = columns_freeze(c, missing, sizeof(missing));

	ex->is_hopeless = r < 0;
	if (r == -ENOENT) {
		snprintf(why, sizeof(why), "has no channel %s", missing);
		return log_fail(ex->err, path, why);
	}
	if (r == -ENOTSUP) {
		snprintf(why, sizeof(why),
			 "%s was recorded as physical values only (record.values)", missing);
		return log_fail(ex->err, path, why);
	}
	if (r == -ENODATA) {
		return log_fail(ex->err, path, "has no /ecdaq/cycle: not a recording of ours");
	}
	if (ex->first == NULL) {
		ex->first = c;
		if (ex->options->format == LOG_TEXT) {
			columns_put_header(c, ex->out);
		}
	} else if (!columns_are_equal(ex->first, c)) {
		ex->is_hopeless = 1;
		return log_fail(
			ex->err, path,
			"has other channels or units than the files before: export it by itself");
	}
	return EXIT_CODE_OK;
}

static int take_message(struct export *ex, struct columns *c, const struct mcap_item *item,
			const char *path)
{
	int r;

	if (!columns_is_frozen(c)) {
		int result = freeze(ex, c, path);

		if (result != EXIT_CODE_OK) {
			return result;
		}
	}
	if (columns_is_cycle(c, item)) {
		put_row(ex, c);
		r = columns_begin_row(c, item);
	} else {
		r = columns_take(c, item);
	}
	return r < 0 ? log_fail(ex->err, path, "a message does not fit to its definition")
		     : EXIT_CODE_OK;
}

static int read_items(struct export *ex, struct columns *c, struct mcap_reader *reader,
		      const char *path)
{
	struct mcap_item item;
	int result = EXIT_CODE_OK;
	int r;

	while ((r = mcap_reader_next(reader, &item)) > 0) {
		if (item.kind == MCAP_ITEM_SCHEMA || item.kind == MCAP_ITEM_CHANNEL) {
			if (columns_learn(c, &item) < 0) {
				return log_fail_errno(ex->err, path, -ENOMEM);
			}
		} else if (item.kind == MCAP_ITEM_MESSAGE) {
			int taken = take_message(ex, c, &item, path);

			if (taken != EXIT_CODE_OK) {
				return taken;
			}
		} else if (item.kind == MCAP_ITEM_DAMAGE && !log_is_recording(path)) {
			/* The undamaged part is exported; the exit code reports the damage. */
			result = log_fail(ex->err, path, item.reason);
		}
	}
	put_row(ex, c);
	return r < 0 ? log_fail_errno(ex->err, path, r) : result;
}

static int export_file(struct export *ex, const char *path)
{
	const struct log_export_options *op = ex->options;
	struct mcap_reader *reader;
	struct log_file file;
	struct columns *c;
	int result;
	int r = log_file_open(path, &file);

	if (r < 0) {
		return log_fail_errno(ex->err, path, r);
	}
	log_file_watch(&file, path);
	r = mcap_reader_create(&file.source, &reader);
	if (r < 0) {
		log_file_close(&file);
		return log_fail_errno(ex->err, path, r);
	}
	c = columns_create(op->channels, op->is_raw, op->format);
	result = c == NULL ? log_fail_errno(ex->err, path, -ENOMEM)
			   : read_items(ex, c, reader, path);
	mcap_reader_destroy(reader);
	log_file_close(&file);
	if (c != ex->first) {
		columns_destroy(c);
	}
	return result;
}

static int export_directory(struct export *ex, const char *dir)
{
	struct store_entry *entries;
	size_t count;
	int result = EXIT_CODE_OK;
	int r = store_list(dir, &entries, &count);

	if (r < 0) {
		return log_fail_errno(ex->err, dir, r);
	}
	for (size_t i = 0; i < count && !ex->is_hopeless; i++) {
		char path[PATH_MAX];
		int one = store_path(dir, entries[i].name, path, sizeof(path)) < 0
				  ? EXIT_CODE_FAILED
				  : export_file(ex, path);

		result = result != EXIT_CODE_OK ? result : one;
	}
	free(entries);
	return result;
}

int log_export(const struct log_export_options *options, FILE *out, FILE *err)
{
	struct export ex = { .options = options, .out = out, .err = err };
	int64_t start_ns = host_clock_ns(CLOCK_MONOTONIC);
	int result = EXIT_CODE_OK;
	off_t bytes;

	for (size_t i = 0; i < options->path_count && !ex.is_hopeless; i++) {
		const char *path = options->paths[i];
		struct stat st;
		int one = stat(path, &st) < 0   ? log_fail_errno(err, path, -errno)
			  : S_ISDIR(st.st_mode) ? export_directory(&ex, path)
						: export_file(&ex, path);

		result = result != EXIT_CODE_OK ? result : one;
	}
	if (result == EXIT_CODE_OK && ex.rows == 0) {
		result = log_fail(err, options->path_count > 0 ? options->paths[0] : "no file",
				  "there is no such cycle");
	}
	columns_destroy(ex.first);
	if (log_finish_output(out, err) != EXIT_CODE_OK) {
		return EXIT_CODE_FAILED;
	}
	bytes = ftello(out); /* -1: a pipe */
	if (bytes >= 0 && options->output != NULL) {
		progress_done(start_ns, "%s: %" PRIu64 " rows, %.1f MiB", options->output, ex.rows,
			      (double)bytes / (1024.0 * 1024.0));
	} else {
		progress_done(start_ns, "%" PRIu64 " rows", ex.rows);
	}
	return result;
}
