/* SPDX-License-Identifier: MIT */
/* ecdaq log check */
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/host_clock.h"
#include "program/exit_code.h"
#include "program/json.h"
#include "program/progress.h"
#include "record/log.h"
#include "record/log_common.h"
#include "record/store.h"

struct gap {
	uint64_t first;
	uint64_t count; /* 0: the cycle number went back to first */
};

enum { GAPS_KEPT = 1000 };

struct checked {
	char path[PATH_MAX];
	struct track track;
	struct mcap_findings found;
	int is_whole;
	int is_recording; /* being written right now: no end is no damage */
	int error;        /* of reading it; else 0 */
	struct gap gap[GAPS_KEPT];
	size_t gap_count; /* kept */
};

struct check {
	struct checked **file;
	size_t count;
};

static void note_gap(void *ctx, uint64_t first, uint64_t count)
{
	struct checked *c = ctx;

	if (c->gap_count < GAPS_KEPT) {
		c->gap[c->gap_count++] = (struct gap){ first, count };
	}
}

static void read_file(struct checked *c)
{
	const struct mcap_visitor visitor = { .item = track_visit, .ctx = &c->track };
	struct mcap_scan *scan;
	struct log_file file;

	track_init(&c->track);
	c->track.gap = note_gap;
	c->track.ctx = c;
	c->error = log_file_open(c->path, &file);
	if (c->error == -ENOENT && log_part_to_final(c->path)) {
		c->is_recording = 0; /* it was finished under our hands */
		c->error = log_file_open(c->path, &file);
	}
	if (c->error < 0) {
		return;
	}
	log_file_watch(&file, c->path);
	c->error = mcap_scan_create(&file.source, &visitor, &scan);
	if (c->error == 0) {
		c->found = *mcap_scan_findings(scan);
		c->is_whole = mcap_scan_is_whole(scan);
		mcap_scan_destroy(scan);
	}
	log_file_close(&file);
}

static int add_file(struct check *ck, const char *path, int is_recording)
{
	struct checked **grown = realloc(ck->file, (ck->count + 1) * sizeof(ck->file[0]));
	struct checked *c;

	if (grown == NULL) {
		return -ENOMEM;
	}
	ck->file = grown;
	c = calloc(1, sizeof(*c));
	if (c == NULL) {
		return -ENOMEM;
	}
	if (snprintf(c->path, sizeof(c->path), "%s", path) >= (int)sizeof(c->path)) {
		free(c);
		return -ENAMETOOLONG;
	}
	c->is_recording = is_recording;
	read_file(c);
	ck->file[ck->count++] = c;
	return 0;
}

static int add_directory(struct check *ck, const char *dir)
{
	struct store_entry *entries;
	size_t count;
	int is_locked = store_is_locked(dir);
	int r = store_list(dir, &entries, &count);

	if (r < 0) {
		return r;
	}
	for (size_t i = 0; r == 0 && i < count; i++) {
		char path[PATH_MAX];

		r = store_path(dir, entries[i].name, path, sizeof(path));
		r = r < 0 ? r : add_file(ck, path, is_locked && entries[i].is_part);
	}
	free(entries);
	return r;
}

static int by_sequence(const void *a, const void *b)
{
	const struct checked *x = *(struct checked *const *)a;
	const struct checked *y = *(struct checked *const *)b;

	if (x->track.before.sequence != y->track.before.sequence) {
		return x->track.before.sequence < y->track.before.sequence ? -1 : 1;
	}
	return strcmp(x->path, y->path);
}

static int is_damaged(const struct checked *c)
{
	if (c->error < 0) {
		return 1;
	}
	/* While it is written, a file has no end, and its last record may be half there. */
	return c->is_recording ? c->found.needs_copy : !c->is_whole;
}

/* From the last cycle of @a to the first of @b, of the same session: cycles between; UINT64_MAX:
 * goes back. */
static uint64_t missing_between(const struct checked *a, const struct checked *b)
{
	if (a == NULL || a->track.cycles == 0 || b->track.cycles == 0 ||
	    a->track.before.session != b->track.before.session) {
		return 0;
	}
	return b->track.first_cycle <= a->track.last_cycle
		       ? UINT64_MAX
		       : b->track.first_cycle - a->track.last_cycle - 1;
}

static void put_gap(FILE *out, const struct gap *g, enum log_format format)
{
	if (format == LOG_JSON) {
		fprintf(out, "{\"first\":%" PRIu64 ",\"count\":%" PRIu64 "}", g->first, g->count);
	} else if (g->count == 0) {
		fprintf(out, "  cycle number goes back to %" PRIu64 "\n", g->first);
	} else {
		fprintf(out, "  gap: %" PRIu64 " cycles from %" PRIu64 " on\n", g->count, g->first);
	}
}

static void put_text(FILE *out, const struct checked *c, uint64_t between)
{
	const struct track *t = &c->track;

	if (between == UINT64_MAX) {
		fprintf(out, "between files: cycle number goes back to %" PRIu64 "\n",
			t->first_cycle);
	} else if (between > 0) {
		fprintf(out, "between files: gap: %" PRIu64 " cycles from %" PRIu64 " on\n",
			between, t->first_cycle - between);
	}
	if (c->error < 0) {
		fprintf(out, "%s: unreadable\n", c->path);
		return;
	}
	fprintf(out, "%s: %s", c->path,
		is_damaged(c)               ? "DAMAGED"
		: t->gaps + t->backward > 0 ? "GAPS"
					    : "ok");
	if (t->cycles > 0) {
		fprintf(out, ", %" PRIu64 " cycles, %" PRIu64 " to %" PRIu64, t->cycles,
			t->first_cycle, t->last_cycle);
	} else {
		fprintf(out, ", no cycles");
	}
	fprintf(out, ", %" PRIu64 " chunks, %s\n", c->found.chunks,
		c->is_recording ? "being recorded" : log_ending_to_str(c->found.ending));
	if (c->found.reason != NULL && !(c->is_recording && !is_damaged(c))) {
		fprintf(out, "  damage at byte %" PRIu64 ": %s (%" PRIu64 " places)\n",
			c->found.reason_offset, c->found.reason, c->found.damaged);
	}
	for (size_t i = 0; i < c->gap_count; i++) {
		put_gap(out, &c->gap[i], LOG_TEXT);
	}
	if (t->gaps + t->backward > c->gap_count) {
		fprintf(out, "  and %" PRIu64 " more\n", t->gaps + t->backward - c->gap_count);
	}
}

static void put_json(FILE *out, const struct checked *c, uint64_t between)
{
	const struct track *t = &c->track;

	fprintf(out, "{\"file\":");
	json_put_text(out, c->path);
	fprintf(out,
		",\"readable\":%s,\"damaged\":%s,\"state\":\"%s\",\"session\":\"%" PRIu64
		"\",\"cycles\":%" PRIu64 ",\"first_cycle\":%" PRIu64 ",\"last_cycle\":%" PRIu64
		",\"chunks\":%" PRIu64 ",\"damaged_records\":%" PRIu64 ",\"missing_before\":",
		c->error < 0 ? "false" : "true", is_damaged(c) ? "true" : "false",
		c->is_recording ? "being recorded" : log_ending_to_str(c->found.ending),
		t->before.session, t->cycles, t->first_cycle, t->last_cycle, c->found.chunks,
		c->found.damaged);
	if (between == UINT64_MAX) {
		fprintf(out, "null");
	} else {
		fprintf(out, "%" PRIu64, between);
	}
	fprintf(out, ",\"went_back\":%" PRIu64 ",\"gap_count\":%" PRIu64 ",\"gaps\":[",
		t->backward + (between == UINT64_MAX), t->gaps);
	for (size_t i = 0; i < c->gap_count; i++) {
		fputs(i > 0 ? "," : "", out);
		put_gap(out, &c->gap[i], LOG_JSON);
	}
	fprintf(out, "]}");
}

struct totals {
	uint64_t cycles;
	uint64_t gaps;
	uint64_t missing;
	uint64_t went_back;
	uint64_t damaged;
};

static void add_totals(struct totals *sum, const struct checked *c, uint64_t between)
{
	sum->cycles += c->track.cycles;
	sum->gaps += c->track.gaps;
	sum->missing += c->track.missing;
	sum->went_back += c->track.backward;
	sum->damaged += (uint64_t)is_damaged(c);
	if (between == UINT64_MAX) {
		sum->went_back++;
	} else if (between > 0) {
		sum->gaps++;
		sum->missing += between;
	}
}

static int put_result(const struct check *ck, enum log_format format, FILE *out, FILE *err)
{
	struct totals sum = { .cycles = 0 };
	const struct checked *before = NULL;
	int is_clean;

	if (format == LOG_JSON) {
		fprintf(out, "{\"files\":[");
	}
	for (size_t i = 0; i < ck->count; i++) {
		const struct checked *c = ck->file[i];
		uint64_t between = missing_between(before, c);

		add_totals(&sum, c, between);
		if (format == LOG_JSON) {
			fputs(i > 0 ? "," : "", out);
			put_json(out, c, between);
		} else {
			put_text(out, c, between);
		}
		if (c->error < 0) {
			log_fail_errno(err, c->path, c->error);
		}
		before = c->error == 0 && c->track.cycles > 0 ? c : before;
	}
	is_clean = sum.damaged == 0 && sum.gaps == 0 && sum.went_back == 0;
	if (format == LOG_JSON) {
		fprintf(out,
			"],\"cycles\":%" PRIu64 ",\"gaps\":%" PRIu64 ",\"cycles_missing\":%" PRIu64
			",\"went_back\":%" PRIu64 ",\"damaged_files\":%" PRIu64 ",\"clean\":%s}\n",
			sum.cycles, sum.gaps, sum.missing, sum.went_back, sum.damaged,
			is_clean ? "true" : "false");
	} else {
		fprintf(out,
			"%zu files, %" PRIu64 " cycles, %" PRIu64 " gaps, %" PRIu64
			" cycles missing, %" PRIu64 " damaged: %s\n",
			ck->count, sum.cycles, sum.gaps, sum.missing, sum.damaged,
			is_clean ? "clean" : "NOT CLEAN");
	}
	return is_clean ? EXIT_CODE_OK : EXIT_CODE_FAILED;
}

int log_check(const char *const *paths, size_t count, enum log_format format, FILE *out, FILE *err)
{
	struct check ck = { .count = 0 };
	int64_t start_ns = host_clock_ns(CLOCK_MONOTONIC);
	int result = EXIT_CODE_OK;

	for (size_t i = 0; i < count && result == EXIT_CODE_OK; i++) {
		struct stat st;
		int r = stat(paths[i], &st) < 0 ? -errno
			: S_ISDIR(st.st_mode) ? add_directory(&ck, paths[i])
					      : add_file(&ck, paths[i], log_is_recording(paths[i]));

		if (r < 0) {
			result = log_fail_errno(err, paths[i], r);
		}
	}
	if (result == EXIT_CODE_OK) {
		if (ck.count > 1) {
			qsort(ck.file, ck.count, sizeof(ck.file[0]), by_sequence);
		}
		result = put_result(&ck, format, out, err);
		progress_done(start_ns, "%zu files checked", ck.count);
		if (log_finish_output(out, err) != EXIT_CODE_OK) {
			result = EXIT_CODE_FAILED;
		}
	}
	for (size_t i = 0; i < ck.count; i++) {
		free(ck.file[i]);
	}
	free(ck.file);
	return result;
}
