/* SPDX-License-Identifier: MIT */
/*
 * Whose event is next: a tournament between all slaves, of which each match is kept. When the time
 * of one changes, its matches alone are played again, up to the first whose result stands. Of
 * slaves with the same time the first one in the list wins. One thread.
 */
#ifndef SIM_SEGMENT_EVENT_QUEUE_H
#define SIM_SEGMENT_EVENT_QUEUE_H

#include <stddef.h>
#include <stdint.h>

struct event_queue {
	size_t places;    /* a power of two */
	int64_t *due_ns;  /* of each place; INT64_MAX: nothing, or no slave */
	uint16_t *winner; /* of match n between matches 2 n and 2 n + 1; from @places on each place
			   */
};

/** For @count slaves, at most 65536, all without an event. 0 or -ENOMEM. */
int event_queue_init(struct event_queue *q, size_t count);
void event_queue_done(struct event_queue *q);

void event_queue_set(struct event_queue *q, size_t slave, int64_t due_ns);

static inline size_t event_queue_first(const struct event_queue *q)
{
	return q->winner[1];
}

#endif
