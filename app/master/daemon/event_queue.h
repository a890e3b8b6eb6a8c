/* SPDX-License-Identifier: MIT */
/*
 * Events of the service thread on their way to the event ring. The ring has one producer, the cycle
 * thread while it runs; so the service thread posts here and the cycle thread collects before it
 * sleeps. One producer, one consumer; a full queue drops the newest and counts it.
 */
#ifndef DAEMON_EVENT_QUEUE_H
#define DAEMON_EVENT_QUEUE_H

#include <stdatomic.h>
#include <stdint.h>

#include "base/event.h"
#include "base/ring.h"

enum { EVENT_QUEUE_CAPACITY = 1024 };

struct event_queue {
	_Alignas(64) _Atomic uint32_t head; /* [service] next slot to fill */
	uint64_t dropped;                   /* [service] */
	_Alignas(64) _Atomic uint32_t tail; /* [cycle] next slot to take */
	_Alignas(64) struct event slot[EVENT_QUEUE_CAPACITY];
};

static_assert((EVENT_QUEUE_CAPACITY & (EVENT_QUEUE_CAPACITY - 1)) == 0,
	      "index wrap needs a power of two");

/** Context: service thread. 0, or -EAGAIN if it was full. */
int event_queue_push(struct event_queue *queue, const struct event *ev);
/** Put what waits onto @events, of which the caller is the producer. RT-safe. */
void event_queue_collect(struct event_queue *queue, struct ring *events);

#endif
