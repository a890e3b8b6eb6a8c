/* SPDX-License-Identifier: MIT */
/*
 * One EtherCAT line: a transport, and the rule who may use it.
 *
 * Direct: the service thread sends and receives itself; this is so from line_create() until
 * line_ride_begin(). Riding: the cycle thread owns the transport. A service frame waits in one of
 * two slots, the supervisor's before the mailbox's; the cycle sends it after its own frames, if it
 * will be off the wire before the next cycle's frames and service frames have not used their share
 * of the period (line_ride_take), and gives the answer back (line_ride_answer). A slot is handed
 * over with acquire and release, without locks; the cycle never waits.
 *
 * A frame that was sent and whose answer is not back after LINE_LOST_CYCLES cycles is lost: frames
 * do not overtake each other, and those of later cycles have come back or are lost, too.
 */
#ifndef LINK_LINE_H
#define LINK_LINE_H

#include <stddef.h>
#include <stdint.h>

#include "base/platform.h"

struct line;

/* Who a service frame belongs to; the first goes first. One thread may use one slot at a time. */
enum line_slot { LINE_SUPERVISOR, LINE_MAILBOX, LINE_SLOTS };

/* How the service thread waits while the cycle owns the transport. */
struct line_waiter {
	/**
	 * Return at @until at the latest, sooner whenever something may have happened. On the
	 * machine: a short sleep. On virtual time: run the next cycle.
	 */
	void (*wait)(void *ctx, mono_t until);
	void *ctx;
};

enum {
	LINE_TRIES = 3,
	LINE_LOST_CYCLES = 2,     /* a frame whose answer is not back then, counted from its own */
	LINE_WINDOW_PERCENT = 95, /* of the period: service frames are off the wire by then */
	LINE_SHARE_PERCENT = 25,  /* of the period, for service frames of both slots, on average */
};

/** Takes over @transport (destroyed with the line). Free with line_destroy(). */
int line_create(struct platform platform, struct transport transport, struct line **ret_line);
void line_destroy(struct line *line);

const struct platform *line_platform(const struct line *line);
/** The transport, for its owner: the cycle while riding, else the service thread. RT-safe. */
const struct transport *line_transport(const struct line *line);

/* --- service thread; never waiting while riding --- */

/**
 * Hand over @frame, whole and valid; it is copied. The top bit of its first index byte is the
 * line's: it tells the slots' answers apart. 0; -EBUSY while a frame of @slot is out; -EINVAL no
 * EtherCAT frame; -EMSGSIZE longer than any cycle has room for (line_frame_limit()).
 * In direct mode it is sent at once.
 */
int line_submit(struct line *line, enum line_slot slot, const uint8_t *frame, size_t frame_len);

/**
 * The answer to it (wire/echo.h: every command, index, address and length the same): its length.
 *  -EAGAIN     it waits to be sent, or is out
 *  -ENOENT     nothing was submitted, or its result was collected already
 *  -ETIMEDOUT  it was sent and no answer came: the slaves may have taken it
 *  -EMSGSIZE   the answer was longer than @capacity: the slaves have taken it
 * Any other -errno: it was never sent; -ENOBUFS, since no cycle had room for it (100 ms), -errno
 * of the transport. In direct mode it waits for the answer, for line_timeout(0) at most, and
 * other frames are dropped and counted; -EAGAIN means there that it was cancelled.
 */
int line_collect(struct line *line, enum line_slot slot, uint8_t *ret_answer, size_t capacity);

/** Length of the longest frame that line_submit() takes: LIMIT_FRAME_BYTES unless set. */
size_t line_frame_limit(const struct line *line);
/** What a cycle has room for at best. Set before line_ride_begin(); direct mode does not mind. */
void line_frame_limit_set(struct line *line, size_t frame_len);

/* --- service thread; blocking --- */

/** SOEM's time, sleep and frames of this thread go to @line from here on (NULL: none). */
void line_bind(struct line *line);
struct line *line_bound(void);

/**
 * line_submit() in the supervisor's slot, and line_collect() as soon as there is a result: its
 * results, but for -EAGAIN and -ENOENT; and -ECANCELED (line_set_cancel(): whether it was sent is
 * unknown). @timeout is for direct mode.
 */
int line_transact(struct line *line, const uint8_t *frame, size_t frame_len, uint8_t *ret_answer,
		  size_t capacity, span_t timeout);

/**
 * How long the first try of a frame waits for its echo; what repeats a frame waits 5 and then 25
 * times as long. 2 ms unless set.
 */
void line_timeout_set(struct line *line, span_t timeout);
/** For try 0 to LINE_TRIES - 1. */
span_t line_timeout(const struct line *line, unsigned try);
/** Before try 0 to LINE_TRIES - 1: while riding, a frame counts as lost after LINE_LOST_CYCLES, and
 * what disturbed it may last longer; so the next try waits as long as the last one would have
 * waited in direct mode. 0 or -ECANCELED. */
int line_pause(struct line *line, unsigned try);

/** @attend is called whenever this thread sends or waits: its keepalive. NULL: none. */
void line_set_keepalive(struct line *line, void (*attend)(void *ctx), void *ctx);

/**
 * line_transact() and line_sleep() return -ECANCELED as soon as @is_cancelled returns 1; it is
 * asked before each frame and pause and at least every 10 ms of waiting. NULL: never.
 */
void line_set_cancel(struct line *line, int (*is_cancelled)(void *ctx), void *ctx);
/** What it says now. */
int line_is_cancelled(const struct line *line);

/** Frames that line_transact() and line_collect() dropped in direct mode. */
uint64_t line_discarded(const struct line *line);
/** Frames of direct mode that were answered. */
uint64_t line_answered(const struct line *line);

/** Frames that came back as they were sent, without the mark of a slave, in either mode. */
uint64_t line_unchanged(const struct line *line);
/* What that means, for a person. */
#define LINE_UNCHANGED_TEXT                                                                        \
	"frames return unchanged, no slave has processed them: loopback or wrong cable (plug, "    \
	"switch, mirrored port)"

/** Wait for @span; while riding, the cycle runs meanwhile. 0 or -ECANCELED. */
int line_sleep(struct line *line, span_t span);

/** From now on the cycle owns the transport, and the service thread waits through @waiter. A frame
 * that is out then counts as lost. */
void line_ride_begin(struct line *line, struct line_waiter waiter);
/** The cycle has ended: back to direct. What waited was not sent, what was out is lost. */
void line_ride_end(struct line *line);

/* --- cycle thread; RT-safe --- */

/** Once a cycle, before line_ride_take(): frames that are out for too long become lost, and service
 * frames may use a share of @period. */
void line_ride_advance(struct line *line, span_t period);
/** The next service frame that occupies the wire for no longer than @room and is within the share;
 * NULL if none. It counts as sent from here on. */
const uint8_t *line_ride_take(struct line *line, span_t room, size_t *ret_len);
/** The transport has refused the frame taken last: -errno. */
void line_ride_refused(struct line *line, int error);
/** Offer a received frame that is not the cycle's: 1 if it was the answer waited for, or one that
 * came too late; else 0. */
int line_ride_answer(struct line *line, const uint8_t *frame, size_t frame_len);
/** A frame of the cycle has come back unchanged (echo_is_unchanged()). */
void line_note_unchanged(struct line *line);
/** 1 while a service frame is out and its answer has not come. */
int line_ride_is_out(const struct line *line);

#endif
