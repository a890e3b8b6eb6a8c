/* SPDX-License-Identifier: MIT */
/*
 * The records of an event ring (ecdaqd, ecdaq-sync0), of the ring of SYNC0 results or of that of
 * captured frames, followed from one run of its writer to the next. Context: one thread at a time
 * for each feed; blocks only as file reads on a tmpfs do.
 */
#ifndef READER_FEED_H
#define READER_FEED_H

#include <stddef.h>
#include <stdint.h>

#include "base/event.h"
#include "base/sync0.h"

enum feed_kind {
	FEED_EVENTS, /* struct event */
	FEED_SYNC0,  /* struct sync0_result */
	FEED_FRAMES, /* FRAME_SLOT_BYTES: struct frame_record, and the frame */
};

/* Where the first ring is entered; later ones are read from their first record. */
enum feed_start { FEED_AT_OLDEST, FEED_AT_NEWEST };

struct feed;

/* A place in some ring. */
struct feed_mark {
	uint64_t next;   /* sequence of the record to read next */
	int64_t mono_ns; /* of the record before it */
};

/** NULL with errno. @path is copied; NULL: there is no such ring. Free with feed_destroy(). */
struct feed *feed_create(enum feed_kind kind, const char *path, enum feed_start start);
void feed_destroy(struct feed *feed);

/**
 * Open the ring at the path if there is one: at @mark as feed_seek() has it; @mark NULL: as @start
 * of feed_create() says. An open ring that was replaced is read to its end first. Call before
 * reading. 0, or why none is open: -ENOENT, -EACCES, -EPROTO (not such a ring),
 * -EIO (truncated or overwritten: until another takes its place).
 */
int feed_open(struct feed *feed, const struct feed_mark *mark);
/** Continue at @mark if it was made in this ring, else at the oldest record. */
void feed_seek(struct feed *feed, const struct feed_mark *mark);
/** Continue at the last @count records; 0: at the oldest. */
void feed_seek_back(struct feed *feed, uint64_t count);

/**
 * The oldest record not read yet and its sequence (NULL: not asked for). @bytes is the size of
 * @ret_record: that of the kind. 1; 0: none. *@ret_lost is increased by the number of
 * records that were overwritten before it.
 */
int feed_read(struct feed *feed, void *ret_record, size_t bytes, uint64_t *ret_sequence,
	      uint64_t *ret_lost);
/** Put the record just read back: it is read again. */
void feed_unread(struct feed *feed);
/** After feed_read() found none: 1 if none will follow. Its writer has closed it or is gone, it is
 * damaged, or no ring is open. */
int feed_is_over(struct feed *feed);

#endif
