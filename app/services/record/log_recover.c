/* SPDX-License-Identifier: MIT */
/* ecdaq log recover */
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/host_clock.h"
#include "program/json.h"
#include "program/progress.h"
#include "record/log.h"
#include "record/log_common.h"
#include "record/recover_file.h"

static const char *result_to_str(enum recover_result result)
{
	switch (result) {
	case RECOVER_WAS_WHOLE:
		return "whole";
	case RECOVER_REPAIRED:
		return "repaired";
	case RECOVER_COPIED:
		return "copied";
	case RECOVER_EMPTY:
		return "empty";
	}
	return "unknown";
}

static void put_result(FILE *out, const char *path, const struct recover_outcome *o,
		       enum log_format format)
{
	if (format == LOG_JSON) {
		fprintf(out, "{\"file\":");
		json_put_text(out, path);
		fprintf(out,
			",\"result\":\"%s\",\"cycles\":%" PRIu64 ",\"last_cycle\":%" PRIu64
			",\"chunks\":%" PRIu64 ",\"messages\":%" PRIu64 ",\"lost_bytes\":%" PRIu64
			",\"damaged_records\":%" PRIu64 "}\n",
			result_to_str(o->result), o->track.cycles, o->track.last_cycle,
			o->found.chunks, o->found.messages, o->found.lost_bytes, o->found.damaged);
		return;
	}
	fprintf(out, "%s: %s: %" PRIu64 " chunks, %" PRIu64 " messages, %" PRIu64 " cycles", path,
		result_to_str(o->result), o->found.chunks, o->found.messages, o->track.cycles);
	if (o->track.cycles > 0 && o->result != RECOVER_WAS_WHOLE) {
		fprintf(out, ", lost after cycle %" PRIu64, o->track.last_cycle);
	}
	fprintf(out, ", %" PRIu64 " bytes discarded\n", o->found.lost_bytes);
}

/* "X.part", repaired, becomes "X.mcap" (@ret_path). */
static int rename_part(const char *path, char ret_path[PATH_MAX])
{
	if (snprintf(ret_path, PATH_MAX, "%s", path) >= PATH_MAX) {
		return -ENAMETOOLONG;
	}
	if (!log_part_to_final(ret_path)) {
		return 0;
	}
	if (access(ret_path, F_OK) == 0) { /* not over another recording */
		return -EEXIST;
	}
	return rename(path, ret_path) < 0 ? -errno : 0;
}

/* The line at the end, where progress is shown. */
static void put_done(int64_t start_ns, const char *path, const struct recover_outcome *o)
{
	struct stat st;
	uint64_t bytes = stat(path, &st) < 0 ? 0 : (uint64_t)st.st_size;

	progress_done(start_ns, "%s: %" PRIu64 " cycles, %.1f MiB", path, o->track.cycles,
		      (double)bytes / (1024.0 * 1024.0));
}

/* Read @path once, or twice for a copy. 0 or -errno, as of recover_file.h. */
static int recover(const char *path, const char *output, struct recover_outcome *o)
{
	struct stat st;
	uint64_t bytes = stat(path, &st) < 0 ? 0 : (uint64_t)st.st_size;
	int r;

	progress_begin(path, output == NULL ? bytes : 2 * bytes);
	r = output == NULL ? recover_in_place(path, progress_at, o)
			   : recover_copy(path, output, progress_at, o);
	progress_end();
	return r;
}

int log_recover(const char *path, const char *output, enum log_format format, FILE *out, FILE *err)
{
	int64_t start_ns = host_clock_ns(CLOCK_MONOTONIC);
	struct recover_outcome o = { .result = RECOVER_EMPTY };
	char final[PATH_MAX];
	int r;

	if (output == NULL && log_is_recording(path)) {
		return log_fail(err, path, "is being recorded");
	}
	r = recover(path, output, &o);
	if (r == -EEXIST && output != NULL) {
		return log_fail(err, output, "already exists");
	}
	if (r < 0) {
		return log_fail_errno(err, path, r);
	}
	if (output == NULL) {
		if (o.result == RECOVER_EMPTY) {
			return log_fail(err, path, "contains no complete chunk");
		}
		r = rename_part(path, final);
		if (r < 0) {
			return log_fail(err, final, strerror(-r));
		}
		output = final;
	}
	put_result(out, output, &o, format);
	r = log_finish_output(out, err);
	put_done(start_ns, output, &o);
	return r;
}
