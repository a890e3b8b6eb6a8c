/* SPDX-License-Identifier: MIT */
#include "record/recorder.h"

#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/platform.h"
#include "base/run_path.h"
#include "reader/feed.h"
#include "reader/reader.h"
#include "record/sample_feed.h"
#include "record/sink.h"

#define LOOK_NS (NS_PER_S / 10) /* for another ring, and between two looks at the status page */
enum { EVENTS_A_STEP = 256, SAMPLES_A_STEP = 2048 };

struct recorder {
	struct recorder_options opt;
	struct sink *sink;
	struct feed *feed[SINK_RINGS];
	int64_t opened_ns[SINK_RINGS]; /* looked for the ring last */
	struct reader *reader;
	struct sample_feed *samples; /* NULL: no session */
	struct record_status *page;  /* shared, or own while there is no run directory */
	struct record_status own;
	int64_t looked_ns;
	int64_t told_ns;
	int ring_error; /* newest reason why no ring is open: told once */
};

__attribute__((format(printf, 2, 3))) static void say(const struct recorder *rec,
						      const char *format, ...)
{
	char line[512];
	va_list args;

	va_start(args, format);
	vsnprintf(line, sizeof(line), format, args);
	va_end(args);
	rec->opt.report(rec->opt.report_ctx, line);
}

/* Look for the rings beside the samples at the next use, and not in some time. */
static void look_for_feeds(struct recorder *rec)
{
	for (int i = 0; i < SINK_RINGS; i++) {
		rec->opened_ns[i] = INT64_MIN / 2;
	}
}

int recorder_create(const struct recorder_options *opt, struct recorder **ret_recorder, char *error,
		    size_t error_bytes)
{
	struct recorder *rec = calloc(1, sizeof(*rec));
	int r;

	if (rec == NULL) {
		snprintf(error, error_bytes, "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	rec->opt = *opt;
	rec->page = &rec->own;
	rec->looked_ns = INT64_MIN / 2;
	rec->told_ns = INT64_MIN / 2;
	look_for_feeds(rec);
	rec->feed[SINK_EVENTS] = feed_create(FEED_EVENTS, opt->events_path, FEED_AT_OLDEST);
	rec->feed[SINK_SYNC0_EVENTS] =
		feed_create(FEED_EVENTS, opt->sync0_events_path, FEED_AT_OLDEST);
	rec->feed[SINK_SYNC0] = feed_create(FEED_SYNC0, opt->sync0_path, FEED_AT_OLDEST);
	for (int i = 0; i < SINK_RINGS; i++) {
		if (rec->feed[i] == NULL) {
			recorder_destroy(rec);
			snprintf(error, error_bytes, "%s", strerror(ENOMEM));
			return -ENOMEM;
		}
	}
	if (reader_create(opt->ring_path, READER_AT_OLDEST, &rec->reader) < 0) {
		recorder_destroy(rec);
		snprintf(error, error_bytes, "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	r = sink_create(opt, &rec->sink, error, error_bytes);
	if (r < 0) {
		recorder_destroy(rec);
		return r;
	}
	*ret_recorder = rec;
	return 0;
}

void recorder_destroy(struct recorder *rec)
{
	if (rec == NULL) {
		return;
	}
	sample_feed_destroy(rec->samples);
	reader_destroy(rec->reader);
	for (int i = 0; i < SINK_RINGS; i++) {
		feed_destroy(rec->feed[i]);
	}
	sink_destroy(rec->sink);
	if (rec->page != &rec->own) {
		status_unmap(rec->page, sizeof(*rec->page));
	}
	free(rec);
}

static int64_t now_ns(const struct recorder *rec)
{
	return rec->opt.platform.now(rec->opt.platform.ctx).ns;
}

static void set_u64(_Atomic uint64_t *field, uint64_t value)
{
	atomic_store_explicit(field, value, memory_order_relaxed);
}

static uint32_t state_of(const struct recorder *rec)
{
	switch (sink_state(rec->sink)) {
	case SINK_FULL:
		return RECORD_DISK_FULL;
	case SINK_FAILED:
		return RECORD_FAILED;
	case SINK_READY:
		break;
	}
	return rec->samples != NULL ? RECORD_RUNNING : RECORD_WAITING;
}

/* The run directory may come later than the recorder: try until the page is there. */
static void have_page(struct recorder *rec)
{
	struct record_status *page;

	if (rec->page != &rec->own || rec->opt.status_path[0] == '\0') {
		return;
	}
	if (run_path_own_folder(rec->opt.status_path) < 0) {
		return;
	}
	page = status_create(rec->opt.status_path, RECORD_STATUS_MAGIC, sizeof(*page), 0644);
	if (page != NULL) {
		page->pid = rec->own.pid;
		rec->page = page;
	}
}

static void tell(struct recorder *rec, uint32_t state)
{
	uint64_t lag = 0;

	have_page(rec);
	rec->page->pid = rec->opt.pid;
	if (rec->samples != NULL) {
		lag = reader_newest(rec->reader) - reader_cursor(rec->reader);
	}
	sink_get_status(rec->sink, rec->page);
	set_u64(&rec->page->lag_cycles, lag);
	atomic_store_explicit(&rec->page->state, state, memory_order_relaxed);
	atomic_fetch_add_explicit(&rec->page->heartbeat, 1, memory_order_relaxed);
}

const struct record_status *recorder_status(const struct recorder *rec)
{
	return rec->page;
}

static struct feed *open_feed(struct recorder *rec, enum sink_ring which)
{
	int64_t now = now_ns(rec);

	if (now - rec->opened_ns[which] >= LOOK_NS) {
		struct feed_mark mark = sink_mark(rec->sink, which);

		rec->opened_ns[which] = now;
		(void)feed_open(rec->feed[which], &mark);
	}
	return rec->feed[which];
}

static void note_ring_error(struct recorder *rec, int error, const char *problem)
{
	if (error == rec->ring_error) {
		return;
	}
	rec->ring_error = error;
	if (error == -ENOENT) {
		say(rec, "waiting for %s", rec->opt.ring_path);
	} else if (error < 0 && error != -EPIPE) {
		say(rec, "%s: %s", rec->opt.ring_path, problem);
	}
}

int recorder_ring_error(const struct recorder *rec)
{
	switch (-rec->ring_error) {
	case EPROTO:
	case EPROTONOSUPPORT:
	case E2BIG:
	case EACCES:
	case EPERM:
		return rec->ring_error;
	default:
		return 0;
	}
}

static void note_clock(struct recorder *rec)
{
	const struct platform *platform = &rec->opt.platform;
	struct clock_quality quality;

	if (platform->clock_quality != NULL &&
	    platform->clock_quality(platform->ctx, &quality) == 0) {
		sample_feed_note_clock(rec->samples, &quality);
	}
}

/* Look for a session, ten times a second. */
static void look_for_session(struct recorder *rec)
{
	uint64_t lost;
	int r;

	if (now_ns(rec) - rec->looked_ns < LOOK_NS) {
		return;
	}
	rec->looked_ns = now_ns(rec);
	if (reader_next(rec->reader, &lost) != READER_BEGUN) {
		note_ring_error(rec, reader_error(rec->reader), reader_problem(rec->reader));
		return;
	}
	r = sample_feed_create(rec->reader, rec->sink, rec->opt.values, &rec->samples);
	note_ring_error(rec, r, reader_error_to_str(r));
	if (r < 0) {
		reader_skip_session(rec->reader);
		return;
	}
	look_for_feeds(rec);
	note_clock(rec);
	say(rec, "recording session %" PRIu64 " to %s", sample_feed_number(rec->samples),
	    rec->opt.dir);
	if (sample_feed_missed_start(rec->samples) > 0) {
		say(rec, "came late: %" PRIu64 " samples had left the ring before",
		    sample_feed_missed_start(rec->samples));
	}
}

enum events_until {
	EVENTS_UNTIL_SAMPLE, /* a backlog of samples is read: later events wait for their time */
	EVENTS_ALL,          /* all samples are read; an event may open a file, too */
};

/* Events go where samples go. Returns how many were taken. */
static int take_events(struct recorder *rec, enum events_until until)
{
	struct feed *feed;
	struct event ev;
	uint64_t sequence;
	int taken = 0;

	if (sink_state(rec->sink) != SINK_READY) {
		return 0;
	}
	feed = open_feed(rec, SINK_EVENTS);
	while (taken < EVENTS_A_STEP) {
		uint64_t lost = 0;
		int got = feed_read(feed, &ev, sizeof(ev), &sequence, &lost);

		if (lost > 0) {
			sink_count_lost_events(rec->sink, lost);
		}
		if (!got) {
			break;
		}
		if ((until == EVENTS_UNTIL_SAMPLE && sample_feed_is_behind(rec->samples, &ev)) ||
		    sample_feed_event(rec->samples, &ev, sequence) < 0) {
			feed_unread(feed);
			break;
		}
		taken++;
	}
	return taken;
}

/* Alarms of ecdaq-sync0 are events, too; they carry no sequence of ecdaqd's ring. */
static void take_sync0_events(struct recorder *rec)
{
	struct feed *feed = open_feed(rec, SINK_SYNC0_EVENTS);
	struct event ev;
	uint64_t sequence;
	uint64_t lost = 0;

	while (feed_read(feed, &ev, sizeof(ev), &sequence, &lost)) {
		if (sample_feed_event(rec->samples, &ev, UINT64_MAX) < 0) {
			feed_unread(feed);
			break;
		}
		sink_mark_sync0_event(rec->sink, &ev, sequence);
	}
}

/* What ecdaq-sync0 said of this session. */
static void take_sync0(struct recorder *rec)
{
	struct sync0_result result;
	struct feed *feed;
	uint64_t sequence;
	uint64_t lost = 0;

	if (sink_state(rec->sink) != SINK_READY) {
		return;
	}
	take_sync0_events(rec);
	feed = open_feed(rec, SINK_SYNC0);
	while (feed_read(feed, &result, sizeof(result), &sequence, &lost)) {
		if (result.session == sample_feed_number(rec->samples) &&
		    sample_feed_sync0(rec->samples, &result, sequence) < 0) {
			feed_unread(feed);
			break;
		}
	}
}

static int end_session(struct recorder *rec, const char *reason)
{
	int r;

	look_for_feeds(rec);
	while (take_events(rec, EVENTS_ALL) == EVENTS_A_STEP) {
	}
	take_sync0(rec);
	r = sink_end_session(rec->sink, reason);
	if (r < 0) {
		return r;
	}
	say(rec, "session %" PRIu64 " ended: %s", sample_feed_number(rec->samples), reason);
	sample_feed_destroy(rec->samples);
	rec->samples = NULL;
	rec->looked_ns = INT64_MIN / 2;
	tell(rec, RECORD_ENDED);
	return 0;
}

static const char *end_reason(int error)
{
	return error == 0 ? "producer ended" : error == -EIO ? "ring damaged" : "producer gone";
}

static enum recorder_result follow(struct recorder *rec)
{
	switch (sample_feed_read(rec->samples, SAMPLES_A_STEP)) {
	case SAMPLE_FEED_MORE:
		(void)take_events(rec, EVENTS_UNTIL_SAMPLE);
		return RECORDER_BUSY;
	case SAMPLE_FEED_EMPTY:
		(void)take_events(rec, EVENTS_ALL);
		take_sync0(rec);
		return RECORDER_IDLE;
	case SAMPLE_FEED_ENDED:
		return end_session(rec, end_reason(reader_error(rec->reader))) == 0 ? RECORDER_ENDED
										    : RECORDER_IDLE;
	case SAMPLE_FEED_STUCK:
		return RECORDER_IDLE;
	}
	return RECORDER_IDLE;
}

enum recorder_result recorder_step(struct recorder *rec)
{
	enum recorder_result result = RECORDER_IDLE;
	int64_t now = now_ns(rec);

	sink_tick(rec->sink, now);
	if (rec->samples == NULL) {
		look_for_session(rec);
	}
	if (rec->samples != NULL && sink_take_rewind(rec->sink)) {
		sample_feed_rewind(rec->samples);
		for (int i = 0; i < SINK_RINGS; i++) {
			struct feed_mark mark = sink_mark(rec->sink, (enum sink_ring)i);

			feed_seek(rec->feed[i], &mark);
		}
	}
	if (rec->samples != NULL && sink_state(rec->sink) == SINK_READY) {
		result = follow(rec);
	}
	if (now - rec->told_ns >= LOOK_NS) {
		rec->told_ns = now;
		if (rec->samples != NULL) {
			note_clock(rec);
		}
		if (result != RECORDER_ENDED) {
			tell(rec, state_of(rec));
		}
	}
	return result;
}

int recorder_finish(struct recorder *rec)
{
	int r = sink_error(rec->sink);

	if (rec->samples != NULL) {
		uint64_t until = reader_newest(rec->reader);
		enum sample_feed_result result = SAMPLE_FEED_MORE;

		while (sink_state(rec->sink) == SINK_READY && result != SAMPLE_FEED_ENDED &&
		       reader_cursor(rec->reader) < until) {
			uint64_t left = until - reader_cursor(rec->reader);

			result = sample_feed_read(rec->samples, left < SAMPLES_A_STEP
									? (unsigned)left
									: SAMPLES_A_STEP);
			sink_tick(rec->sink, now_ns(rec));
		}
		r = end_session(rec, "stopped");
	}
	tell(rec, r < 0 ? RECORD_FAILED : RECORD_ENDED);
	return r;
}
