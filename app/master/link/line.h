/* SPDX-License-Identifier: MIT */
/*
 * One EtherCAT line: a transport, and the rule who may use it.
 *
 * Direct: the service thread (SOEM's functions, through nicdrv.c) sends and receives itself; this
 * is so from line_create() until line_ride_begin(). Riding: the cycle thread owns the transport. A
 * service frame waits in one slot; the cycle sends it when time is left in its cycle
 * (line_ride_take) and gives the answer back (line_ride_answer). There is one service thread, so
 * one slot is enough; it is handed over with acquire and release, without locks; the cycle never
 * waits.
 */
#ifndef LINK_LINE_H
#define LINK_LINE_H

#include <stddef.h>
#include <stdint.h>

#include "base/platform.h"

struct line;

/* How the service thread waits while the cycle owns the transport. */
struct line_waiter {
	/**
	 * Return at @until at the latest, sooner whenever something may have happened. On the
	 * machine: a short sleep. On virtual time: run the next cycle.
	 */
	void (*wait)(void *ctx, mono_t until);
	void *ctx;
};

enum { LINE_TRIES = 3 };

/** Takes over @transport (destroyed with the line). Free with line_destroy(). */
int line_create(struct platform platform, struct transport transport, struct line **ret_line);
void line_destroy(struct line *line);

const struct platform *line_platform(const struct line *line);
/** The transport, for its owner: the cycle while riding, else the service thread. RT-safe. */
const struct transport *line_transport(const struct line *line);

/* --- service thread; blocking --- */

/** SOEM's time, sleep and frames of this thread go to @line from here on (NULL: none). */
void line_bind(struct line *line);
struct line *line_bound(void);

/**
 * Send @frame and wait for its echo (wire/echo.h: every command, index, address and length the
 * same). Returns the answer's length, -ETIMEDOUT, -EINVAL for bytes that are no EtherCAT frame, or
 * -errno of the transport. Other frames are dropped and counted. While riding, @timeout is 100
 * ms at least.
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

/** @attend is called whenever this thread sends or waits: its keepalive. NULL: none. */
void line_set_keepalive(struct line *line, void (*attend)(void *ctx), void *ctx);

/** Frames that line_transact() dropped in direct mode. */
uint64_t line_discarded(const struct line *line);
/** Transactions of direct mode that were answered. */
uint64_t line_answered(const struct line *line);

/** Wait for @span; while riding, the cycle runs meanwhile. */
void line_sleep(struct line *line, span_t span);

/** From now on the cycle owns the transport, and the service thread waits through @waiter. */
void line_ride_begin(struct line *line, struct line_waiter waiter);
/** The cycle has ended: back to direct. */
void line_ride_end(struct line *line);

/* --- cycle thread; RT-safe --- */

/** The service frame that waits for a ride, NULL if none. It counts as sent from here on. */
const uint8_t *line_ride_take(struct line *line, size_t *ret_len);
/** Offer a received frame that is not the cycle's: 1 if it was the answer waited for, else 0. */
int line_ride_answer(struct line *line, const uint8_t *frame, size_t frame_len);
/** 1 while a service frame is out and its answer has not come. */
int line_ride_is_out(const struct line *line);

#endif
