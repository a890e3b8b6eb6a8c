/* SPDX-License-Identifier: MIT */
/*
 * The events of an appliance on their subject: each a message of its own, as recordings have it.
 * Context: one thread.
 */
#ifndef STREAM_EVENT_LANE_H
#define STREAM_EVENT_LANE_H

#include <stdint.h>

#include "reader/feed.h"
#include "record/messages.h"
#include "stream/broker.h"

struct event_lane {
	char subject[BROKER_SUBJECT_BYTES];
	uint64_t sequence; /* of its newest message in the stream; 0: none */
	struct mark mark;  /* of that message */
	uint8_t data[MESSAGES_LARGEST_BYTES];
};

void event_lane_init(struct event_lane *e, const char *appliance);
/** Continue behind the newest message; NULL: there is none. */
void event_lane_start(struct event_lane *e, const struct broker_newest *newest);
/** Where the ring is to be read on; 0: the stream has no event. */
int event_lane_feed_mark(const struct event_lane *e, struct feed_mark *ret_mark);

/** The message of @ev, which belongs to @session; valid until the next call. @ev->sequence
 * UINT64_MAX: it is ours, and not in the ring. */
void event_lane_message(struct event_lane *e, const struct messages_event *ev, uint64_t session,
			struct broker_message *ret);
/** The same of an event as a recording has it: 1; 0: the stream has it, or it is the recorder's. */
int event_lane_recorded(struct event_lane *e, const uint8_t *data, size_t len, uint64_t session,
			struct broker_message *ret);
/** @message was stored. */
void event_lane_stored(struct event_lane *e, const struct broker_message *message);

#endif
