/* SPDX-License-Identifier: MIT */
/* The results of ecdaq-sync0 to ecdaq/sync0; follows it through restarts. Context: publisher's
 * thread. */
#ifndef PUBLISH_SYNC0_H
#define PUBLISH_SYNC0_H

#include "base/ring.h"
#include "config/config.h"
#include "publish/topics.h"

struct samples;

struct sync0 {
	char path[CONFIG_PATH_BYTES];
	struct ring_reader *ring; /* NULL: none is open */
	int was_open;
};

/** Look for a ring, or for another one in its place. */
void sync0_follow(struct sync0 *sync0);
/** Publish what is new. @samples, for session and time; NULL: none. */
void sync0_step(struct sync0 *sync0, const struct topics *topics, const struct samples *samples);
void sync0_close(struct sync0 *sync0);

#endif
