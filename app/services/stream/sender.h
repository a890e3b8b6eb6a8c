/* SPDX-License-Identifier: MIT */
/*
 * Cycles and events of one appliance on their way to the broker, wherever they were read: blocks
 * are filled and sent, gaps between cycles are reported. Context: one thread; blocks up to the
 * broker's timeouts.
 */
#ifndef STREAM_SENDER_H
#define STREAM_SENDER_H

#include <stdint.h>

#include "base/status.h"
#include "config/config.h"
#include "stream/broker.h"
#include "stream/event_lane.h"
#include "stream/lanes.h"
#include "stream/topics.h"

enum { SENDER_APPLIANCE_BYTES = 64 };

/* The newest block of the appliance in the stream. */
struct position {
	int is_known;
	uint64_t session;
	uint64_t first_cycle;
};

struct sender {
	const struct config *cfg;
	char appliance[SENDER_APPLIANCE_BYTES];
	char blocks[BROKER_SUBJECT_BYTES]; /* subjects */
	char channels[BROKER_SUBJECT_BYTES];
	struct broker *broker;
	struct stream_status *now; /* counts */
	char problem[BROKER_PROBLEM_BYTES];
	uint64_t stored;    /* exchanges that went well */
	int64_t flushed_ns; /* CLOCK_MONOTONIC, when nothing was left to be sent */
	struct position position;
	char channels_id[BROKER_ID_BYTES]; /* of the newest description in the stream */
	char *description; /* of the session, to be sent before its first block; NULL: was sent */
	struct event_lane events;
	struct lanes *lanes; /* of the session that is sent; NULL: none */
	struct broker_message *message;
	size_t capacity; /* of message */
	uint64_t session;
	uint64_t next_cycle; /* that should follow, if has_next */
	int has_next;
};

/* All of these: 0, or negative with a line in problem. */

/** Begin to send a session, of the ring or of a recording, behind what the stream has of it. */
int sender_begin_session(struct sender *s, const struct topics *topics);
/** @cycle is next: what is missing before it is counted and reported, at @utc_ns. */
int sender_mind_gap(struct sender *s, uint64_t cycle, int64_t utc_ns);
/** The message of one slave, copied; what was collected is sent first where it must be. */
int sender_take(struct sender *s, size_t lane, uint64_t cycle, const void *data, size_t len);
/** Send what was collected. */
int sender_flush(struct sender *s);
int sender_put_event(struct sender *s, struct broker_message *m);
void sender_done(struct sender *s);

#endif
