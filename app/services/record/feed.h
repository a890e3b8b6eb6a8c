/* SPDX-License-Identifier: MIT */
/* A ring of records, events or results of ecdaq-sync0, followed from one run of its writer to the
 * next. Context: blocking. */
#ifndef RECORD_FEED_H
#define RECORD_FEED_H

#include <stdint.h>

enum feed_kind {
	FEED_EVENTS, /* struct event */
	FEED_SYNC0,  /* struct sync0_result */
};

struct feed;

/* A place in some ring. */
struct feed_mark {
	uint64_t next;   /* sequence of the record to read next */
	int64_t mono_ns; /* of the record before it */
};

/** NULL with errno. @path is kept; NULL: there is no such ring. */
struct feed *feed_create(enum feed_kind kind, const char *path);
void feed_destroy(struct feed *f);

/**
 * Open the ring at the path if there is one: at @mark if the mark was made in it, else at its
 * oldest record. An open ring that was replaced is drained first. Call before reading.
 */
void feed_open(struct feed *f, const struct feed_mark *mark);
/** Go (back) to @mark in the same way. */
void feed_seek(struct feed *f, const struct feed_mark *mark);

/** The oldest record not read, as its kind has it, and its sequence. 1, 0 none; *@ret_lost counts
 * records overwritten before. */
int feed_read(struct feed *f, void *ret_record, uint64_t *ret_sequence, uint64_t *ret_lost);
/** Take the record just read back: it is read again. */
void feed_unread(struct feed *f);

#endif
