/* SPDX-License-Identifier: MIT */
/* The event ring to ecdaq/event; follows the master through restarts. Context: publisher's thread.
 */
#ifndef PUBLISH_EVENTS_H
#define PUBLISH_EVENTS_H

#include "publish/topics.h"
#include "reader/feed.h"

struct samples;

/** Publish what is new in @feed. @samples, for session and time; NULL: none. */
void events_step(struct feed *feed, const struct topics *topics, const struct samples *samples);

#endif
