/* SPDX-License-Identifier: MIT */
#include "record/sink_internal.h"

#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void sink_say(struct sink *s, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(s->message, sizeof(s->message), format, args);
	va_end(args);
	s->opt.report(s->opt.report_ctx, s->message);
}

static void report_recovery(void *ctx, const char *text)
{
	struct sink *s = ctx;

	s->opt.report(s->opt.report_ctx, text);
}

static int recover(struct sink *s)
{
	const struct recover_report report = { .line = report_recovery, .ctx = s };
	int r = recover_store(s->store, &report, &s->resume);

	return r < 0 ? r : store_save_state(s->store, &s->resume);
}

static int open_store(struct sink *s, char *error, size_t error_bytes)
{
	int64_t pid = 0;
	int r = store_open(s->opt.dir, &s->store, &pid);

	if (r == -EBUSY) {
		snprintf(error, error_bytes,
			 "%s: another ecdaq-record (process %" PRId64 ") records there", s->opt.dir,
			 pid);
	} else if (r < 0) {
		snprintf(error, error_bytes, "%s: %s", s->opt.dir, strerror(-r));
	}
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
	r = open_store(s, error, error_bytes);
	if (r < 0) {
		free(s);
		return r;
	}
	/* If the state file is missing or damaged, the recordings tell where to resume. */
	(void)store_load_state(s->store, &s->resume);
	r = recover(s);
	if (r < 0) {
		sink_say(s, "%s: cannot recover what is there: %s; trying again", opt->dir,
			 strerror(-r));
		s->state = SINK_FAILED;
	}
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

	switch (which) {
	case SINK_EVENTS:
		return (struct feed_mark){ resume->event_next, resume->event_mono_ns };
	case SINK_SYNC0_EVENTS:
		return (struct feed_mark){ resume->sync0_event_next, resume->sync0_event_mono_ns };
	case SINK_SYNC0:
	case SINK_RINGS:
		break;
	}
	return (struct feed_mark){ resume->sync0_next, resume->sync0_mono_ns };
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

int sink_ask_free_bytes(struct sink *s)
{
	const struct record_seam *seam = s->opt.seam;

	return seam != NULL && seam->free_bytes != NULL
		       ? seam->free_bytes(seam->ctx, s->opt.dir, &s->bytes_free)
		       : store_free_bytes(s->store, &s->bytes_free);
}

int sink_trouble(struct sink *s, int error, const char *what)
{
	s->checked_ns = s->now_ns;
	if (error == -ENOSPC || error == -EDQUOT) {
		if (s->state != SINK_FULL) {
			sink_say(s,
				 "recording stopped, disk full: %s: %" PRIu64
				 " bytes free, reserve %" PRIu64,
				 s->opt.dir, s->bytes_free, s->opt.reserve_bytes);
			s->full_event = (struct event){ .id = EVENT_RECORD_DISK_FULL,
							.cycle = s->resume.next_cycle,
							.value = (int64_t)s->bytes_free,
							.slave_pos = EVENT_NO_SLAVE };
			s->full_utc_ns = s->last_utc_ns;
		}
		s->state = SINK_FULL;
		return error;
	}
	if (s->state != SINK_FAILED) {
		sink_say(s, "recording failed: %s: %s: %s; trying again", s->opt.dir, what,
			 strerror(-error));
	}
	/* What is on disk is recovered as after a crash; what is not is still in the ring. */
	record_file_destroy(s->file);
	s->file = NULL;
	s->state = SINK_FAILED;
	return error;
}

void sink_begin_session(struct sink *s, const struct layout *layout, enum sink_news news)
{
	s->layout = layout;
	s->timemap = (struct timemap_state){ .tai_offset_s = layout_meta(layout)->tai_offset_s };
	if (news == SINK_NEW_SESSION) {
		s->resume.session = layout_meta(layout)->session;
		s->resume.next_cycle = 0;
		s->resume.first_cycle = 0;
		s->resume.cycles = 0;
		s->resume.gaps = 0;
		s->resume.missing = 0;
	}
	s->events_lost = 0;
	s->synced_cycle = sink_last_cycle(s);
}

void sink_count_gap(struct sink *s, uint64_t cycles)
{
	s->resume.gaps++;
	s->resume.missing += cycles;
}

void sink_count_lost_events(struct sink *s, uint64_t events)
{
	s->events_lost += events;
	sink_say(s, "%" PRIu64 " events were overwritten before they could be recorded", events);
}

static void check_space(struct sink *s)
{
	uint64_t open_bytes = record_file_final_bytes(s->file);
	int r = store_enforce_budget(s->store, s->opt.budget_bytes, open_bytes);

	if (r < 0) {
		sink_say(s, "%s: cannot delete old recordings: %s", s->opt.dir, strerror(-r));
	}
	s->checked_ns = s->now_ns;
	if (sink_ask_free_bytes(s) == 0 && s->bytes_free < s->opt.reserve_bytes) {
		(void)sink_trouble(s, -ENOSPC, s->opt.dir);
		/* The reserve is there for this: leave a whole file behind. */
		(void)sink_finish_file(s, "disk full");
	}
}

static void tick_ready(struct sink *s)
{
	if (s->file == NULL) {
		return;
	}
	if (s->chunk_opened_ns != 0 && s->now_ns - s->chunk_opened_ns >= s->opt.chunk_period_ns &&
	    sink_close_chunk(s) < 0) {
		return;
	}
	if (s->now_ns - s->synced_ns >= s->opt.sync_period_ns) {
		if (s->is_dirty) {
			(void)sink_sync_file(s);
		}
		if (s->state == SINK_READY && s->now_ns - s->checked_ns >= SINK_RETRY_NS) {
			check_space(s);
		}
	}
	if (s->state == SINK_READY && s->file != NULL && sink_is_rotation_due(s)) {
		(void)sink_finish_file(s, "rotated");
	}
}

/* Once a second: is there space again? The reserve and an eighth, so that it does not go to and
 * fro. */
static void tick_full(struct sink *s)
{
	uint64_t wanted = s->opt.reserve_bytes + s->opt.reserve_bytes / 8;

	s->checked_ns = s->now_ns;
	if (s->file != NULL && sink_finish_file(s, "disk full") < 0) {
		return;
	}
	if (sink_ask_free_bytes(s) < 0 || s->bytes_free < wanted || s->bytes_free == 0) {
		return;
	}
	s->state = SINK_READY;
	sink_say(s, "recording again: %" PRIu64 " bytes free", s->bytes_free);
	s->message[0] = '\0';
}

static void tick_failed(struct sink *s)
{
	s->checked_ns = s->now_ns;
	if (recover(s) < 0) {
		return;
	}
	s->state = SINK_READY;
	s->has_rewind = 1;
	sink_say(s, "recording again behind cycle %" PRIu64, s->resume.next_cycle);
	s->message[0] = '\0';
}

void sink_tick(struct sink *s, int64_t now_ns)
{
	s->now_ns = now_ns;
	if (s->state == SINK_READY) {
		tick_ready(s);
	} else if (now_ns - s->checked_ns < SINK_RETRY_NS) {
		return;
	} else if (s->state == SINK_FULL) {
		tick_full(s);
	} else {
		tick_failed(s);
	}
}

uint64_t sink_last_cycle(const struct sink *s)
{
	return s->resume.next_cycle > 0 ? s->resume.next_cycle - 1 : 0;
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
	atomic_store_explicit(&page->session, s->resume.session, memory_order_relaxed);
	atomic_store_explicit(&page->recorded_cycles, s->resume.cycles, memory_order_relaxed);
	atomic_store_explicit(&page->recorded_gaps, s->resume.gaps, memory_order_relaxed);
	atomic_store_explicit(&page->cycles_missing, s->resume.missing, memory_order_relaxed);
	atomic_store_explicit(&page->first_cycle, s->resume.first_cycle, memory_order_relaxed);
	atomic_store_explicit(&page->last_cycle, sink_last_cycle(s), memory_order_relaxed);
	atomic_store_explicit(&page->synced_cycle, s->synced_cycle, memory_order_relaxed);
	atomic_store_explicit(&page->bytes_written, s->bytes_done + open_bytes,
			      memory_order_relaxed);
	atomic_store_explicit(&page->files, s->files, memory_order_relaxed);
	atomic_store_explicit(&page->bytes_free, s->bytes_free, memory_order_relaxed);
}
