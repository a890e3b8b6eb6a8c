/* SPDX-License-Identifier: MIT */
/* The result ring of ecdaq-sync0, followed through its restarts. Context: blocking. */
#ifndef RECORD_SYNC0_FEED_H
#define RECORD_SYNC0_FEED_H

#include <stdint.h>

#include "base/sync0.h"
#include "record/event_feed.h"

struct sync0_feed;

/** NULL with errno. @path is kept. */
struct sync0_feed *sync0_feed_create(const char *path);
void sync0_feed_destroy(struct sync0_feed *f);
/** Open the ring if there is one, at @mark or its oldest result; one that was replaced is drained
 * first. Call before reading. */
void sync0_feed_open(struct sync0_feed *f, const struct event_mark *mark);
/** Go (back) to @mark in the same way. */
void sync0_feed_seek(struct sync0_feed *f, const struct event_mark *mark);
/** The oldest result not read, and its sequence. 1, 0 none. */
int sync0_feed_read(struct sync0_feed *f, struct sync0_result *ret, uint64_t *ret_sequence);
/** Take the result just read back: it is read again. */
void sync0_feed_unread(struct sync0_feed *f);

#endif
