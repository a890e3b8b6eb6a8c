/* SPDX-License-Identifier: MIT */
/* The event ring to ecdaq/event; follows the master through restarts. Context: publisher's thread.
 */
#ifndef PUBLISH_EVENTS_H
#define PUBLISH_EVENTS_H

#include "base/ring.h"
#include "config/config.h"
#include "publish/topics.h"

struct samples;

struct events {
	char path[CONFIG_PATH_BYTES];
	struct ring_reader *ring; /* NULL: none is open */
	int was_open;
};

/** Look for a ring, or for another one in its place. */
void events_follow(struct events *events);
/** Publish what is new. @samples, for session and time; NULL: none. */
void events_step(struct events *events, const struct topics *topics, const struct samples *samples);
void events_close(struct events *events);

#endif
