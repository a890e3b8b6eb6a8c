/* SPDX-License-Identifier: MIT */
/* The event ring, followed from one run of the master to the next. Context: blocking. */
#ifndef RECORD_EVENT_FEED_H
#define RECORD_EVENT_FEED_H

#include <stdint.h>

#include "base/event.h"

struct event_feed;

/** NULL with errno. @path is kept. */
struct event_feed *event_feed_create(const char *path);
void event_feed_destroy(struct event_feed *f);

/* A place in some event ring. */
struct event_mark {
	uint64_t next;   /* sequence of the event to read next */
	int64_t mono_ns; /* of the event before it */
};

/**
 * Open the ring at the path if there is one: at @mark if the mark was made in it, else at its
 * oldest event. An open ring that was replaced is drained first. Call before reading.
 */
void event_feed_open(struct event_feed *f, const struct event_mark *mark);
/** Go (back) to @mark in the same way. */
void event_feed_seek(struct event_feed *f, const struct event_mark *mark);

/** The oldest event not read, and its sequence. 1, 0 none; *@ret_lost counts events overwritten
 * before. */
int event_feed_read(struct event_feed *f, struct event *ret_event, uint64_t *ret_sequence,
		    uint64_t *ret_lost);
/** Take the event just read back: it is read again. */
void event_feed_unread(struct event_feed *f);

#endif
