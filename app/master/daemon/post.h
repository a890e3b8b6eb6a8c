/* SPDX-License-Identifier: MIT */
/*
 * Events of the service thread on their way to the event ring. The ring has one producer, the cycle
 * thread while it runs; so the service thread posts here and the cycle thread collects before it
 * sleeps. One producer, one consumer; a full queue drops the newest and counts it.
 */
#ifndef DAEMON_POST_H
#define DAEMON_POST_H

#include <stdatomic.h>
#include <stdint.h>

#include "base/event.h"
#include "base/ring.h"

enum { POST_CAPACITY = 1024 };

struct post {
	_Alignas(64) _Atomic uint32_t head; /* [service] next slot to fill */
	uint64_t dropped;                   /* [service] */
	_Alignas(64) _Atomic uint32_t tail; /* [cycle] next slot to take */
	_Alignas(64) struct event slot[POST_CAPACITY];
};

static_assert((POST_CAPACITY & (POST_CAPACITY - 1)) == 0, "index wrap needs a power of two");

/** Context: service thread. 0, or -EAGAIN if it was full. */
int post_push(struct post *post, const struct event *ev);
/** Put what waits onto @events, of which the caller is the producer. RT-safe. */
void post_collect(struct post *post, struct ring *events);

#endif
