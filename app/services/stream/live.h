/* SPDX-License-Identifier: MIT */
/*
 * The sample ring as messages of its slaves, as ecdaq-record would record them: one session, from
 * the oldest sample that the ring holds. Context: one thread; never waits.
 */
#ifndef STREAM_LIVE_H
#define STREAM_LIVE_H

#include <stddef.h>
#include <stdint.h>

#include "config/config.h"
#include "stream/topics.h"

struct live;

enum live_result {
	LIVE_BEGUN,   /* a session: live_topics() */
	LIVE_SAMPLE,  /* live_cycle(), live_message() */
	LIVE_EMPTY,   /* nothing new yet */
	LIVE_ENDED,   /* the session has ended and all of it was read */
	LIVE_WAITING, /* there is no session; live_problem() */
	LIVE_LOST,    /* samples left the ring unread */
	LIVE_FAILED,  /* no memory */
};

/** 0, -ENOMEM, -ENAMETOOLONG. Free with live_destroy(). */
int live_create(const struct config *cfg, struct live **ret_live);
void live_destroy(struct live *l);

enum live_result live_next(struct live *l);
/** Of the session, from LIVE_BEGUN to the next one. */
const struct topics *live_topics(const struct live *l);
uint64_t live_cycle(const struct live *l);
/** UTC of the newest sample, Unix ns; 0: none yet. */
int64_t live_utc_ns(const struct live *l);
/** The message of topic @lane; valid until the next call. */
const uint8_t *live_message(struct live *l, size_t lane, size_t *ret_len);
/** 1 if the session was there from its first sample on when it began to be read. */
int live_is_whole(const struct live *l);
/** Samples in the ring that were not read yet. */
uint64_t live_lag(const struct live *l);
/** Take over the kernel's TAI offset; call it about once a second. */
void live_follow_clock(struct live *l);
/** CLOCK_TAI to Unix time. */
int64_t live_utc_of_tai(const struct live *l, int64_t tai_ns);
const char *live_problem(const struct live *l);

#endif
