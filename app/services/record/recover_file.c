/* SPDX-License-Identifier: MIT */
#include "record/recover_file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "record/file_io.h"

/* A note in the file that it was repaired, and what is known to be lost. */
static int put_note(struct mcap_writer *w, const struct recover_outcome *o)
{
	char last[24];
	char cycles[24];
	char chunks[24];
	char lost_bytes[24];
	char damaged[24];
	const struct mcap_pair pairs[] = {
		{ "note", "recovered: the file was not closed or was damaged" },
		{ "lost_after_cycle", last },
		{ "cycles", cycles },
		{ "chunks", chunks },
		{ "lost_bytes", lost_bytes },
		{ "damaged_records", damaged },
		{ "first_damage", o->found.reason != NULL ? o->found.reason : "" },
	};

	snprintf(last, sizeof(last), "%" PRIu64, o->track.last_cycle);
	snprintf(cycles, sizeof(cycles), "%" PRIu64, o->track.cycles);
	snprintf(chunks, sizeof(chunks), "%" PRIu64, o->found.chunks);
	snprintf(lost_bytes, sizeof(lost_bytes), "%" PRIu64, o->found.lost_bytes);
	snprintf(damaged, sizeof(damaged), "%" PRIu64, o->found.damaged);
	return mcap_writer_metadata(w, "ecdaq.recovered", pairs, sizeof(pairs) / sizeof(pairs[0]));
}

static int note_and_finish(struct mcap_writer *w, const struct recover_outcome *o)
{
	int r = put_note(w, o);

	return r < 0 ? r : mcap_writer_finish(w);
}

static int look(int *fd, void (*watch)(uint64_t done), struct recover_outcome *o,
		struct mcap_scan **ret_scan)
{
	const struct mcap_visitor visitor = { .item = track_visit, .ctx = &o->track };
	struct file_watch watching;
	struct mcap_source source;
	int r = file_source(fd, &source);

	track_init(&o->track);
	if (r == 0) {
		file_watch(&watching, &source, watch, 0);
		r = mcap_scan_create(&source, &visitor, ret_scan);
	}
	if (r == 0) {
		o->found = *mcap_scan_findings(*ret_scan);
	}
	return r;
}

static int repair(int *fd, struct mcap_scan *scan, const struct recover_outcome *o)
{
	struct mcap_io io = file_io(fd);
	struct mcap_writer *w;
	int r = mcap_scan_resume(scan, &io, &w);

	if (r < 0) {
		return r;
	}
	r = note_and_finish(w, o);
	mcap_writer_destroy(w);
	return r;
}

int recover_in_place(const char *path, void (*watch)(uint64_t done),
		     struct recover_outcome *ret_outcome)
{
	struct recover_outcome o = { .result = RECOVER_REPAIRED };
	struct mcap_scan *scan = NULL;
	int fd = open(path, O_RDWR | O_CLOEXEC);
	int r;

	if (fd < 0) {
		return -errno;
	}
	r = look(&fd, watch, &o, &scan);
	if (r != 0) {
		close(fd);
		return r;
	}
	if (mcap_scan_is_whole(scan)) {
		o.result = RECOVER_WAS_WHOLE;
		r = fdatasync(fd) < 0 ? -errno : 0;
	} else if (o.found.messages == 0 && !o.found.needs_copy) {
		o.result = RECOVER_EMPTY;
	} else {
		r = repair(&fd, scan, &o);
	}
	mcap_scan_destroy(scan);
	if (close(fd) < 0 && r == 0) {
		r = -errno;
	}
	if (r == 0) {
		*ret_outcome = o;
	}
	return r;
}

static int copy_to(int *fd, const struct mcap_scan *scan, const char *output,
		   void (*watch)(uint64_t done), const struct recover_outcome *o)
{
	struct file_watch watching;
	struct mcap_source source;
	struct mcap_writer *w;
	struct mcap_io io;
	int out = open(output, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
	int r;

	if (out < 0) {
		return -errno;
	}
	io = file_io(&out);
	r = mcap_writer_create(&io, 0, &w);
	if (r == 0) {
		r = file_source(fd, &source);
		if (r == 0) {
			file_watch(&watching, &source, watch, source.bytes);
			r = mcap_copy_whole(&source, scan, w);
		}
		r = r < 0 ? r : note_and_finish(w, o);
		mcap_writer_destroy(w);
	}
	if (close(out) < 0 && r == 0) {
		r = -errno;
	}
	if (r < 0) {
		unlink(output);
	}
	return r;
}

int recover_copy(const char *path, const char *output, void (*watch)(uint64_t done),
		 struct recover_outcome *ret_outcome)
{
	struct recover_outcome o = { .result = RECOVER_COPIED };
	struct mcap_scan *scan = NULL;
	int fd = open(path, O_RDONLY | O_CLOEXEC);
	int r;

	if (fd < 0) {
		return -errno;
	}
	r = look(&fd, watch, &o, &scan);
	if (r == 0) {
		r = copy_to(&fd, scan, output, watch, &o);
		mcap_scan_destroy(scan);
	}
	close(fd);
	if (r == 0) {
		*ret_outcome = o;
	}
	return r;
}

static void report_line(const struct recover_report *report, const char *name, const char *what)
{
	char line[512];

	snprintf(line, sizeof(line), "%s: %s", name, what);
	report->line(report->ctx, line);
}

static void report_outcome(const struct recover_report *report, const char *name,
			   const struct recover_outcome *o)
{
	char what[320];

	switch (o->result) {
	case RECOVER_WAS_WHOLE:
		report_line(report, name, "complete, but had not been renamed");
		return;
	case RECOVER_EMPTY:
		report_line(report, name, "removed: contains no sample");
		return;
	case RECOVER_REPAIRED:
	case RECOVER_COPIED:
		snprintf(what, sizeof(what),
			 "recovered %" PRIu64 " cycles up to cycle %" PRIu64 "%s%s",
			 o->track.cycles, o->track.last_cycle,
			 o->result == RECOVER_COPIED ? "; the damaged file is kept as .damaged: "
						     : "",
			 o->result == RECOVER_COPIED && o->found.reason != NULL ? o->found.reason
										: "");
		report_line(report, name, what);
		return;
	}
}

static void set_state(struct store_state *state, const struct track *t)
{
	if (t->has_session && t->before.sequence >= state->sequence) {
		struct store_state known = *state;

		*state = track_state(t);
		/* Not in the recordings; a mark of another ring is known as such by its time. */
		state->sync0_next = known.sync0_next;
		state->sync0_mono_ns = known.sync0_mono_ns;
		state->sync0_event_next = known.sync0_event_next;
		state->sync0_event_mono_ns = known.sync0_event_mono_ns;
	}
}

/* "DIR/NAME.part" to "DIR/NAME<suffix>". */
static int rename_part(const char *part, const char *suffix)
{
	char path[PATH_MAX];
	size_t stem = strlen(part) - strlen(".part");

	if (snprintf(path, sizeof(path), "%.*s%s", (int)stem, part, suffix) >= (int)sizeof(path)) {
		return -ENAMETOOLONG;
	}
	return rename(part, path) < 0 ? -errno : 0;
}

/* Damaged before its end: the copy takes its place, the original is kept aside. */
static int replace_by_copy(const char *part, struct recover_outcome *o)
{
	char copy[PATH_MAX];
	char final[PATH_MAX];
	size_t stem = strlen(part) - strlen(".part");
	int r;

	if (snprintf(copy, sizeof(copy), "%s.copy", part) >= (int)sizeof(copy) ||
	    snprintf(final, sizeof(final), "%.*s.mcap", (int)stem, part) >= (int)sizeof(final)) {
		return -ENAMETOOLONG;
	}
	unlink(copy); /* of an attempt that was cut short */
	r = recover_copy(part, copy, NULL, o);
	if (r < 0) {
		return r;
	}
	if (rename(copy, final) < 0) {
		return -errno;
	}
	return rename_part(part, ".damaged");
}

static int may_pass(int error)
{
	return error == -ENOSPC || error == -EDQUOT || error == -ENOMEM;
}

/* No single file stops recording. */
static void set_aside(const char *path, const char *name, int error,
		      const struct recover_report *report)
{
	char why[160];
	char what[320];
	int r = rename_part(path, ".damaged");

	snprintf(why, sizeof(why), "%s", error == -EPROTO ? "not an MCAP file" : strerror(-error));
	snprintf(what, sizeof(what), "not recovered: %s; %s%s", why,
		 r < 0 ? "left as it is: " : "kept as .damaged", r < 0 ? strerror(-r) : "");
	report_line(report, name, what);
}

static int recover_path(const char *path, struct recover_outcome *o)
{
	int r = recover_in_place(path, NULL, o);

	if (r == -EPROTO || r == -ENOMEM) {
		return r;
	}
	if (r == -ENODATA || (r == 0 && o->result == RECOVER_EMPTY)) {
		o->result = RECOVER_EMPTY;
		return unlink(path) < 0 ? -errno : 0;
	}
	/* Also where writing or the sync failed: a copy is written and synced from the start. */
	return r < 0 ? replace_by_copy(path, o) : rename_part(path, ".mcap");
}

static int recover_part(const struct store *s, const struct store_entry *e,
			const struct recover_report *report, struct store_state *state)
{
	struct recover_outcome o = { .result = RECOVER_EMPTY };
	char path[PATH_MAX];
	int r = store_path(store_dir(s), e->name, path, sizeof(path));

	if (r < 0) {
		return r;
	}
	track_init(&o.track);
	r = recover_path(path, &o);
	if (r == 0) {
		report_outcome(report, e->name, &o);
		set_state(state, &o.track);
		return 0;
	}
	if (may_pass(r)) {
		report_line(report, e->name, strerror(-r));
		return r;
	}
	set_aside(path, e->name, r, report);
	state->sequence = e->sequence > state->sequence ? e->sequence : state->sequence;
	return 0;
}

/* A finished file that is newer than the state (which was lost, or could not be written) knows
 * better. */
static void ask_finished(const struct store *s, const struct store_entry *e, int is_newest,
			 struct store_state *state)
{
	struct recover_outcome o = { .result = RECOVER_WAS_WHOLE };
	struct mcap_scan *scan = NULL;
	char path[PATH_MAX];
	int fd;

	if (e->sequence <= state->sequence) {
		return;
	}
	fd = !is_newest || store_path(store_dir(s), e->name, path, sizeof(path)) < 0
		     ? -1
		     : open(path, O_RDONLY | O_CLOEXEC);
	if (fd >= 0) {
		if (look(&fd, NULL, &o, &scan) == 0) {
			mcap_scan_destroy(scan);
			set_state(state, &o.track);
		}
		close(fd);
	}
	state->sequence = e->sequence;
}

int recover_store(const struct store *s, const struct recover_report *report,
		  struct store_state *state)
{
	struct store_entry *entries;
	size_t count;
	int first = 0;
	int changed = 0;
	int r = store_list(store_dir(s), &entries, &count);

	if (r < 0) {
		return r;
	}
	for (size_t i = 0; i < count; i++) {
		if (!entries[i].is_part) {
			ask_finished(s, &entries[i], i + 1 == count, state);
			continue;
		}
		changed = 1;
		r = recover_part(s, &entries[i], report, state);
		first = first < 0 ? first : r;
	}
	free(entries);
	if (changed && first == 0) {
		first = file_sync_dir(store_dir(s));
	}
	return first;
}
