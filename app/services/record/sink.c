/* SPDX-License-Identifier: MIT */
#include "record/sink.h"

#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "record/clock_steps.h"
#include "record/space.h"

#define SINK_RETRY_NS NS_PER_S

struct sink {
	struct recorder_options opt;
	struct store *store;
	struct store_state resume;  /* where to resume if recording stopped now */
	struct store_state durable; /* the same after the last good sync */
	uint64_t durable_bytes;     /* of the open file */
	uint64_t head_bytes;        /* the same */
	enum sink_state state;
	int error;        /* why the state is not SINK_READY */
	unsigned retries; /* since the last good sync */
	int has_rewind;
	struct record_file *file;    /* NULL between files */
	const struct layout *layout; /* NULL between sessions */
	struct timemap_state timemap;
	int64_t now_ns; /* of the newest tick */
	struct clock_steps steps;
	int64_t file_opened_ns;
	int64_t chunk_opened_ns; /* 0: the chunk is empty */
	int64_t synced_ns;
	int64_t checked_ns;   /* last check of free space and errors */
	int is_dirty;         /* written since the last sync */
	uint64_t events_lost; /* in this session, by this process */
	uint64_t files;
	uint64_t bytes_done; /* in finished files */
	struct space space;
	int64_t last_utc_ns;     /* of the newest sample */
	struct event full_event; /* the disk was full: written to the next file */
	int64_t full_utc_ns;
	int has_put_full_event;   /* to the open file, which is not durable yet */
	char abandoned[PATH_MAX]; /* a file that failed, to be cut to abandoned_bytes; "": none */
	uint64_t abandoned_bytes;
	char path[512]; /* of the newest file */
	char message[256];
};

/* The open file, below. Each: 0, or -errno after fail(). */
static int close_chunk(struct sink *s);
static int sync_file(struct sink *s);
static int finish_file(struct sink *s, const char *reason);
static int is_rotation_due(const struct sink *s);
static int finish_after_step(struct sink *s);

/* The newest cycle recorded; 0 before the first. */
static uint64_t last_cycle(const struct store_state *state)
{
	return state->next_cycle > 0 ? state->next_cycle - 1 : 0;
}

__attribute__((format(printf, 2, 3))) static void report(struct sink *s, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(s->message, sizeof(s->message), format, args);
	va_end(args);
	s->opt.report(s->opt.report_ctx, s->message);
}

static void halt(struct sink *s, int error, const char *what)
{
	int is_full = error == -ENOSPC || error == -EDQUOT;
	int is_news = error != s->error || s->retries == 0;

	s->checked_ns = s->now_ns;
	s->error = error;
	if (is_full && is_news) {
		report(s,
		       "recording stopped, disk full: %s: %" PRIu64 " bytes free, reserve %" PRIu64
		       "; %" PRIu64 " bytes of recordings, budget %" PRIu64,
		       s->opt.dir, s->space.bytes_free, s->opt.reserve_bytes, s->space.bytes_kept,
		       s->opt.budget_bytes);
		s->full_event = (struct event){ .id = EVENT_RECORD_DISK_FULL,
						.cycle = s->resume.next_cycle,
						.value = (int64_t)s->space.bytes_free,
						.slave_pos = EVENT_NO_SLAVE };
		s->full_utc_ns = s->last_utc_ns;
	} else if (is_news) {
		report(s, "recording failed: %s: %s: %s; trying again", s->opt.dir, what,
		       strerror(-error));
	}
	s->state = is_full ? SINK_FULL : SINK_FAILED;
}

static void report_recovery(void *ctx, const char *text)
{
	struct sink *s = ctx;

	if (s->retries <= 1) { /* the same files again: told already */
		s->opt.report(s->opt.report_ctx, text);
	}
}

static int recover(struct sink *s)
{
	const struct recover_report report = { .line = report_recovery, .ctx = s };
	int r = recover_store(s->store, &report, &s->resume);

	(void)store_save_state(s->store, &s->resume); /* the recordings know it, too */
	return r;
}

int sink_create(const struct recorder_options *opt, struct sink **ret_sink, char *error,
		size_t error_bytes)
{
	struct sink *s = calloc(1, sizeof(*s));
	int r;

	if (s == NULL) {
		snprintf(error, error_bytes, "%s: %s", opt->dir, strerror(ENOMEM));
		return -ENOMEM;
	}
	s->opt = *opt;
	s->space.opt = &s->opt;
	r = store_open_or_tell(s->opt.dir, &s->store, error, error_bytes);
	if (r < 0) {
		free(s);
		return r;
	}
	/* If the state file is missing or damaged, the recordings tell where to resume. */
	(void)store_load_state(s->store, &s->resume);
	r = recover(s);
	if (r < 0) {
		halt(s, r, "cannot recover what is there");
	}
	s->durable = s->resume;
	*ret_sink = s;
	return 0;
}

void sink_destroy(struct sink *s)
{
	if (s == NULL) {
		return;
	}
	record_file_destroy(s->file);
	store_close(s->store);
	free(s);
}

const struct store_state *sink_resume_point(const struct sink *s)
{
	return &s->resume;
}

struct feed_mark sink_mark(const struct sink *s, enum sink_ring which)
{
	const struct store_state *resume = &s->resume;

	if (which == SINK_EVENTS) {
		return (struct feed_mark){ resume->event_next, resume->event_mono_ns };
	}
	if (which == SINK_SYNC0_EVENTS) {
		return (struct feed_mark){ resume->sync0_event_next, resume->sync0_event_mono_ns };
	}
	return (struct feed_mark){ resume->sync0_next, resume->sync0_mono_ns };
}

int sink_error(const struct sink *s)
{
	return s->state == SINK_READY ? 0 : s->error;
}

enum sink_state sink_state(const struct sink *s)
{
	return s->state;
}

int sink_take_rewind(struct sink *s)
{
	int has_rewind = s->has_rewind;

	s->has_rewind = 0;
	return has_rewind;
}

/* All that was written to the open file is on disk. */
static void note_durable(struct sink *s)
{
	s->durable = s->resume;
	s->durable_bytes = record_file_bytes(s->file);
	if (s->retries > 0) {
		s->retries = 0;
		report(s, "recording again: on disk up to cycle %" PRIu64, last_cycle(&s->durable));
		s->message[0] = '\0';
	}
	if (s->has_put_full_event) {
		s->full_event.id = EVENT_NONE;
		s->has_put_full_event = 0;
	}
}

/* A call to the file system failed: nothing since the last sync is believed to be on disk. */
static int fail(struct sink *s, int error, const char *what)
{
	uint64_t sequence = s->resume.sequence;

	halt(s, error, what);
	if (s->file != NULL) {
		snprintf(s->abandoned, sizeof(s->abandoned), "%s", record_file_path(s->file));
		s->abandoned_bytes = s->durable_bytes;
		/* Now, or a recorder that starts meanwhile would believe it; if it fails, later. */
		(void)record_file_cut(s->file, s->abandoned_bytes);
		record_file_destroy(s->file);
		s->file = NULL;
	}
	s->has_put_full_event = 0;
	s->resume = s->durable;
	s->resume.sequence = sequence;
	return error;
}

void sink_begin_session(struct sink *s, const struct layout *layout, enum sink_news news)
{
	s->layout = layout;
	s->timemap = timemap_state_unknown(layout_meta(layout)->tai_offset_s);
	if (news == SINK_NEW_SESSION) {
		s->resume.session = layout_meta(layout)->session;
		s->resume.next_cycle = 0;
		s->resume.first_cycle = 0;
		s->resume.cycles = 0;
		s->resume.gaps = 0;
		s->resume.missing = 0;
	}
	s->events_lost = 0;
	s->durable = s->resume;
}

void sink_count_gap(struct sink *s, uint64_t cycles)
{
	s->resume.gaps++;
	s->resume.missing += cycles;
}

void sink_count_lost_events(struct sink *s, uint64_t events)
{
	s->events_lost += events;
	report(s, "%" PRIu64 " events were overwritten before they could be recorded", events);
}

static void keep_room(struct sink *s, int r)
{
	s->checked_ns = s->now_ns;
	if (r < 0) {
		halt(s, r, "room for recordings");
		/* Room for the end was kept: leave a whole file behind. */
		(void)finish_file(s, "disk full");
	}
}

static void tick_ready(struct sink *s)
{
	if (s->file == NULL) {
		return;
	}
	if (s->chunk_opened_ns != 0 && s->now_ns - s->chunk_opened_ns >= s->opt.chunk_period_ns &&
	    close_chunk(s) < 0) {
		return;
	}
	if (s->now_ns - s->synced_ns >= s->opt.sync_period_ns) {
		if (s->is_dirty) {
			(void)sync_file(s);
		}
		if (s->state == SINK_READY && s->now_ns - s->checked_ns >= SINK_RETRY_NS) {
			keep_room(s, space_make(&s->space, s->file, s->space.chunk_bytes));
		}
	}
	if (s->state == SINK_READY && clock_steps_is_due(&s->steps, s->now_ns)) {
		(void)finish_after_step(s);
	}
	if (s->state == SINK_READY && s->file != NULL && is_rotation_due(s)) {
		(void)finish_file(s, "rotated");
	}
}

/* Finish what a failure left behind, and be ready. */
static void come_back(struct sink *s)
{
	s->retries++;
	if (s->abandoned[0] != '\0' && truncate(s->abandoned, (off_t)s->abandoned_bytes) < 0 &&
	    errno != ENOENT) {
		return;
	}
	if (recover(s) < 0) {
		return;
	}
	s->abandoned[0] = '\0';
	s->durable = s->resume;
	s->state = SINK_READY;
	s->has_rewind = 1;
	s->message[0] = '\0';
}

void sink_tick(struct sink *s, int64_t now_ns)
{
	s->now_ns = now_ns;
	if (s->state == SINK_READY) {
		tick_ready(s);
	} else if (now_ns - s->checked_ns >= SINK_RETRY_NS) {
		s->checked_ns = now_ns;
		if (s->state == SINK_FAILED || space_to_begin(&s->space) == 0) {
			come_back(s);
		}
	}
}

static void set_u64(_Atomic uint64_t *field, uint64_t value)
{
	atomic_store_explicit(field, value, memory_order_relaxed);
}

void sink_get_status(struct sink *s, struct record_status *page)
{
	uint64_t open_bytes = s->file != NULL ? record_file_bytes(s->file) : 0;

	if (strcmp(page->path, s->path) != 0) {
		status_text_set(&page->text_sequence, page->path, sizeof(page->path), s->path);
	}
	if (strcmp(page->message, s->message) != 0) {
		status_text_set(&page->text_sequence, page->message, sizeof(page->message),
				s->message);
	}
	set_u64(&page->session, s->resume.session);
	set_u64(&page->recorded_cycles, s->resume.cycles);
	set_u64(&page->recorded_gaps, s->resume.gaps);
	set_u64(&page->cycles_missing, s->resume.missing);
	set_u64(&page->first_cycle, s->resume.first_cycle);
	set_u64(&page->last_cycle, last_cycle(&s->resume));
	set_u64(&page->synced_cycle, last_cycle(&s->durable));
	set_u64(&page->bytes_written, s->bytes_done + open_bytes);
	set_u64(&page->files, s->files);
	set_u64(&page->bytes_free, s->space.bytes_free);
}

/* Own events carry no ring sequence. */
static int put_own_event(struct sink *s, const struct event *ev, int64_t utc_ns)
{
	char text[256];

	event_format(ev, text, sizeof(text));
	return record_file_event(s->file, &(struct messages_event){ .event = *ev,
								    .sequence = UINT64_MAX,
								    .utc_ns = utc_ns,
								    .text = text });
}

static int put_first_events(struct sink *s, uint64_t first_cycle, int64_t utc_ns)
{
	struct event ev = { .id = EVENT_RECORD_STARTED,
			    .cycle = first_cycle,
			    .value = (int64_t)first_cycle,
			    .slave_pos = EVENT_NO_SLAVE };
	int r = put_own_event(s, &ev, utc_ns);

	if (r < 0 || s->full_event.id == EVENT_NONE) {
		return r;
	}
	r = put_own_event(s, &s->full_event, s->full_utc_ns);
	ev.id = EVENT_RECORD_RESUMED;
	r = r < 0 ? r : put_own_event(s, &ev, utc_ns);
	s->has_put_full_event = r == 0;
	return r;
}

int sink_open_file(struct sink *s, uint64_t first_cycle, int64_t utc_ns)
{
	char name[STORE_NAME_BYTES];
	struct record_file_spec spec = { .dir = s->opt.dir,
					 .name = name,
					 .layout = s->layout,
					 .zstd_level = s->opt.zstd_level,
					 .before = &s->resume,
					 .file_sequence = s->resume.sequence + 1,
					 .start_utc_ns = utc_ns > 0 ? (uint64_t)utc_ns : 0,
					 .timemap = &s->timemap,
					 .config_path = s->opt.config_path,
					 .config_text = s->opt.config_text,
					 .seam = s->opt.seam };
	int r;

	if (s->file != NULL) {
		return 0;
	}
	r = space_make(&s->space, NULL, s->head_bytes);
	if (r < 0) {
		return fail(s, r, "room for recordings");
	}
	store_make_name(name, utc_ns, s->resume.session, spec.file_sequence);
	r = record_file_create(&spec, &s->file);
	if (r < 0) {
		return fail(s, r, name);
	}
	s->resume.sequence++;
	s->durable_bytes = 0;
	s->head_bytes = record_file_bytes(s->file);
	s->space.seen_bytes = s->head_bytes;
	s->files++;
	clock_steps_forget(&s->steps);
	snprintf(s->path, sizeof(s->path), "%s", record_file_path(s->file));
	s->file_opened_ns = s->now_ns;
	s->synced_ns = s->now_ns;
	s->chunk_opened_ns = s->now_ns;
	s->is_dirty = 1;
	r = put_first_events(s, first_cycle, utc_ns);
	return r < 0 ? fail(s, r, name) : 0;
}

static int finish_file(struct sink *s, const char *reason)
{
	const struct record_file_end end = { .reason = reason,
					     .events_lost = s->events_lost,
					     .after = &s->resume,
					     .timemap = &s->timemap };
	int r = record_file_finish(s->file, &end);

	if (r == 0) {
		/* The state before the name: if we are killed in between, .part and state agree. */
		int saved = store_save_state(s->store, &s->resume);

		note_durable(s);
		if (saved < 0) { /* the newest file holds the same, it is only slower to read */
			report(s, "%s: state file: %s", s->opt.dir, strerror(-saved));
		}
		r = record_file_publish(s->file);
	}
	if (r < 0) {
		return fail(s, r, record_file_path(s->file));
	}
	snprintf(s->path, sizeof(s->path), "%s", record_file_path(s->file));
	s->is_dirty = 0;
	s->chunk_opened_ns = 0;
	s->bytes_done += record_file_bytes(s->file);
	record_file_destroy(s->file);
	s->file = NULL;
	return 0;
}

int sink_end_session(struct sink *s, const char *reason)
{
	int r = s->state == SINK_READY && s->file != NULL ? finish_file(s, reason) : sink_error(s);

	s->layout = r < 0 ? s->layout : NULL;
	return r;
}

static int close_chunk(struct sink *s)
{
	int r = record_file_close_chunk(s->file);

	if (r < 0) {
		return fail(s, r, record_file_path(s->file));
	}
	s->chunk_opened_ns = 0;
	s->is_dirty = 1;
	keep_room(s, space_for_chunk(&s->space, s->file));
	return sink_error(s);
}

static int is_rotation_due(const struct sink *s)
{
	uint64_t bytes = record_file_final_bytes(s->file);

	return (s->opt.rotate_bytes > 0 && bytes >= s->opt.rotate_bytes) ||
	       bytes >= space_largest_file(&s->space, s->file) ||
	       (s->opt.rotate_period_ns > 0 &&
		s->now_ns - s->file_opened_ns >= s->opt.rotate_period_ns) ||
	       record_file_is_full(s->file);
}

/* Something was put into the open file, with result @r. */
static int note_put(struct sink *s, int r)
{
	if (r < 0) {
		return fail(s, r, record_file_path(s->file));
	}
	s->chunk_opened_ns = s->chunk_opened_ns == 0 ? s->now_ns : s->chunk_opened_ns;
	return 0;
}

int sink_sample(struct sink *s, const struct sample_header *header, const uint8_t *image,
		int64_t utc_ns)
{
	int64_t period_ns = (int64_t)layout_meta(s->layout)->period_ns;
	int r = record_file_sample(s->file, header, image, utc_ns > 0 ? (uint64_t)utc_ns : 0);

	if (note_put(s, r) < 0) {
		return r;
	}
	if (s->resume.cycles++ == 0) {
		s->resume.first_cycle = header->cycle;
	}
	s->last_utc_ns = utc_ns;
	s->resume.next_cycle = header->cycle + 1;
	/* By bus time, too: a backlog is read much faster than it came. */
	if ((int64_t)record_file_open_cycles(s->file) >= s->opt.chunk_period_ns / period_ns) {
		(void)close_chunk(s); /* the sample is kept; an error shows in the state */
		if (s->state == SINK_READY && is_rotation_due(s)) {
			(void)finish_file(s, "rotated");
		}
	}
	return 0;
}

int sink_event(struct sink *s, const struct messages_event *ev)
{
	int r = record_file_event(s->file, ev);

	if (note_put(s, r) < 0) {
		return r;
	}
	if (ev->sequence != UINT64_MAX) {
		s->resume.event_next = ev->sequence + 1;
		s->resume.event_mono_ns = ev->event.mono_ns;
	}
	return 0;
}

int sink_sync0(struct sink *s, const struct sync0_result *result, int64_t utc_ns, uint64_t sequence)
{
	int r = record_file_sync0(s->file, result, utc_ns);

	if (note_put(s, r) < 0) {
		return r;
	}
	s->resume.sync0_next = sequence + 1;
	s->resume.sync0_mono_ns = result->mono_ns;
	return 0;
}

void sink_mark_sync0_event(struct sink *s, const struct event *ev, uint64_t sequence)
{
	s->resume.sync0_event_next = sequence + 1;
	s->resume.sync0_event_mono_ns = ev->mono_ns;
}

int sink_timemap(struct sink *s, const struct timemap_state *state)
{
	uint64_t utc_ns = state->utc_ns > 0 ? (uint64_t)state->utc_ns : 0;

	s->timemap = *state;
	return s->file == NULL ? 0 : note_put(s, record_file_timemap(s->file, state, utc_ns));
}

static int finish_after_step(struct sink *s)
{
	clock_steps_take(&s->steps, s->now_ns, s->message, sizeof(s->message));
	s->opt.report(s->opt.report_ctx, s->message);
	return s->file != NULL ? finish_file(s, "clock step") : 0;
}

int sink_clock_step(struct sink *s, const struct timemap_state *state)
{
	int r;

	clock_steps_note(&s->steps, state->step_ns);
	if (s->file != NULL && !clock_steps_is_due(&s->steps, s->now_ns)) {
		return sink_timemap(s, state);
	}
	r = finish_after_step(s);
	s->timemap = *state;
	return r;
}

static int sync_file(struct sink *s)
{
	int r;

	if (s->chunk_opened_ns != 0) {
		r = close_chunk(s);
		if (r < 0) {
			return r;
		}
	}
	r = record_file_sync(s->file);
	if (r < 0) {
		return fail(s, r, record_file_path(s->file));
	}
	s->synced_ns = s->now_ns;
	note_durable(s);
	s->is_dirty = 0;
	return 0;
}
