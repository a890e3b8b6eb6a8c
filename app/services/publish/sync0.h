/* SPDX-License-Identifier: MIT */
/* The results of ecdaq-sync0 to ecdaq/sync0; follows it through restarts. Context: publisher's
 * thread. */
#ifndef PUBLISH_SYNC0_H
#define PUBLISH_SYNC0_H

#include "publish/topics.h"
#include "reader/feed.h"

struct samples;

/** Publish what is new in @feed. @samples, for session and time; NULL: none. */
void sync0_step(struct feed *feed, const struct topics *topics, const struct samples *samples);

#endif
