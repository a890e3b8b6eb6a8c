/* SPDX-License-Identifier: MIT */
/* New records of the event and SYNC0 rings to their topics. Context: the publisher's thread. */
#ifndef PUBLISH_FEEDS_H
#define PUBLISH_FEEDS_H

#include "publish/topics.h"
#include "reader/feed.h"

struct sample_writer;

/** Publish the new events of @feed. @samples, for session and time; NULL: no session. */
void feeds_put_events(struct feed *feed, const struct topics *topics,
		      const struct sample_writer *samples);
/** Publish the new SYNC0 results of @feed. */
void feeds_put_sync0(struct feed *feed, const struct topics *topics,
		     const struct sample_writer *samples);

#endif
