/* SPDX-License-Identifier: MIT */
/*
 * Where samples go: the store and the file being written, with all that is due on time (chunk,
 * sync, rotation, budget) and all that can go wrong. A full disk or a failing one makes the sink
 * not ready; the caller then leaves samples in the ring and comes back. A file whose write or sync
 * failed is cut to what the last sync made durable: after a failed sync the page cache shows bytes
 * that the disk may not have. The rest is read again from the ring. Context: blocking.
 */
#ifndef RECORD_SINK_H
#define RECORD_SINK_H

#include "base/event.h"
#include "reader/feed.h"
#include "record/record_file.h"
#include "record/recorder.h"
#include "record/recover_file.h"
#include "record/store.h"

struct sink;

enum sink_state {
	SINK_READY,
	SINK_FULL,   /* no space, or less than the reserve; checked again every second */
	SINK_FAILED, /* another error; tried again every second */
};

/** Lock the directory and recover what is unfinished. As recorder_create(). */
int sink_create(const struct recorder_options *opt, struct sink **ret_sink, char *error,
		size_t error_bytes);
void sink_destroy(struct sink *s);

/** Where recording resumes, according to the store. */
const struct store_state *sink_resume_point(const struct sink *s);

/* The rings whose records are kept beside the samples. */
enum sink_ring { SINK_EVENTS, SINK_SYNC0_EVENTS, SINK_SYNC0, SINK_RINGS };

/** The same in one of those rings. */
struct feed_mark sink_mark(const struct sink *s, enum sink_ring which);

enum sink_news {
	SINK_NEW_SESSION,   /* nothing of it was recorded yet */
	SINK_KNOWN_SESSION, /* it goes on at sink_resume_point() */
};

/** A session begins: its layout (kept until sink_end_session()). */
void sink_begin_session(struct sink *s, const struct layout *layout, enum sink_news news);
/** Finish the file of the session. 0, or -errno: not ready, and not all is recorded; call again
 * when it is. */
int sink_end_session(struct sink *s, const char *reason);

enum sink_state sink_state(const struct sink *s);
/** Why it is not ready: -errno; 0: it is. */
int sink_error(const struct sink *s);
/** 1 once after a failure was recovered: read again from sink_resume_point(). */
int sink_take_rewind(struct sink *s);

/** Do what is due at @now_ns (CLOCK_MONOTONIC). Call it often. */
void sink_tick(struct sink *s, int64_t now_ns);

/* These return 0, or -errno: not taken, the sink is not ready. */
/** Have a file open, so that what follows goes into one file. */
int sink_open_file(struct sink *s, uint64_t first_cycle, int64_t utc_ns);
int sink_sample(struct sink *s, const struct sample_header *header, const uint8_t *image,
		int64_t utc_ns);
int sink_event(struct sink *s, const struct messages_event *ev);
/** A result of ecdaq-sync0, and its place in that ring; an alarm of it, the same. */
int sink_sync0(struct sink *s, const struct sync0_result *result, int64_t utc_ns,
	       uint64_t sequence);
void sink_mark_sync0_event(struct sink *s, const struct event *ev, uint64_t sequence);
int sink_timemap(struct sink *s, const struct timemap_state *state);
/** UTC took a step: what follows goes to a new file, so that log times go up inside each; to the
 * same one, in which log time waits, if a step made one less than CLOCK_STEPS_PERIOD_NS ago. */
int sink_clock_step(struct sink *s, const struct timemap_state *state);

/** Count a gap of this session. */
void sink_count_gap(struct sink *s, uint64_t cycles);
void sink_count_lost_events(struct sink *s, uint64_t events);

/** Put the sink's figures into the status page. */
void sink_get_status(struct sink *s, struct record_status *page);

#endif
