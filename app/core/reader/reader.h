/* SPDX-License-Identifier: MIT */
/*
 * Reads the samples of ecdaqd, one after the other, through its restarts. A session is one run of
 * the bus: it has its own ring at the same path, its own slaves and channels.
 *
 *	reader_create("/run/ecdaq/samples", READER_AT_NEWEST, &reader);
 *	for (;;) {
 *		switch (reader_next(reader, &lost)) {
 *		case READER_BEGUN:   look up channels in reader_table(reader)
 *		case READER_SAMPLE:  use reader_header(reader), reader_image(reader)
 *		case READER_LOST:    count lost
 *		case READER_EMPTY: case READER_WAITING: case READER_ENDED:  wait some milliseconds
 *		}
 *	}
 *
 * Nothing it does can disturb the master, and no change of the ring's file, whoever makes it, can
 * disturb it: a ring that is truncated or overwritten ends the session with an error (ADR 42).
 *
 * Context: one thread at a time for each reader; blocks only as file reads on a tmpfs do.
 */
#ifndef READER_READER_H
#define READER_READER_H

#include <stdint.h>

#include "base/sample.h"
#include "reader/table.h"

struct reader;

/* Where the first session is entered; later ones are read from their first sample. */
enum reader_start {
	READER_AT_NEWEST, /* what is pushed from now on */
	READER_AT_OLDEST, /* all that the ring still holds */
};

enum reader_result {
	READER_SAMPLE, /* the next sample: reader_header(), reader_image() */
	READER_LOST,   /* too slow: *ret_lost samples were overwritten unread */
	READER_EMPTY, /* nothing new yet; right after samples it is not asked whether more will come
		       */
	READER_BEGUN, /* a session has begun: reader_table() */
	READER_ENDED, /* the session has ended and all of it was read; reader_error(): how */
	READER_WAITING, /* no session yet, or no other one; reader_error(): why */
};

/** @path is copied. 0, or -ENOMEM. There need be no ring yet. Free with reader_destroy(). */
int reader_create(const char *path, enum reader_start start, struct reader **ret_reader);
void reader_destroy(struct reader *reader);

/** Take the next step. Never waits. @ret_lost is written for READER_LOST only. */
enum reader_result reader_next(struct reader *reader, uint64_t *ret_lost);

/**
 * After READER_WAITING: -ENOENT no ring, -EPROTO not a sample ring or not consistent,
 * -EPROTONOSUPPORT one of another version, -EACCES, ... After READER_ENDED: 0 closed in order,
 * -EPIPE its process is gone or another ring is in its place, -EIO truncated or overwritten.
 */
int reader_error(const struct reader *reader);
/** reader_error() in one line, for people; with both numbers if the version is the cause. */
const char *reader_problem(const struct reader *reader);
/** The same for an error other than -EPROTONOSUPPORT, without a reader. */
const char *reader_error_to_str(int error);

/** Of the session, until the reader_next() that returns the next READER_BEGUN; NULL before. */
const struct channel_table *reader_table(const struct reader *reader);

/** The sample read last; reader_image() has meta.image_bytes bytes. */
const struct sample_header *reader_header(const struct reader *reader);
const uint8_t *reader_image(const struct reader *reader);
/** Read the newest sample without changing what reader_next() reads next. 1; 0: none yet, or no
 * session. */
int reader_read_newest(struct reader *reader);

/*
 * Samples are numbered within the ring from 0 in the order they were pushed (not: cycle numbers).
 * All of these are 0 without a session.
 */
uint64_t reader_cursor(const struct reader *reader); /* reader_next() reads this one */
uint64_t reader_oldest(struct reader *reader);       /* that can still be read */
uint64_t reader_newest(struct reader *reader);       /* one past it */
/** Continue at @sequence; a session that has ended is read again from there. */
void reader_seek(struct reader *reader, uint64_t sequence);
/** 1 if the process of the session is gone without ending it. */
int reader_is_orphaned(struct reader *reader);
/** Read no more of this session; reader_next() waits for the next one. */
void reader_skip_session(struct reader *reader);

#endif
