/* SPDX-License-Identifier: MIT */
/*
 * Streams samples and events of one appliance: from the ring, and from recordings where the ring
 * has them no more. Whatever fails, the connection is closed, and what to send next is found by
 * what the stream has. Context: one thread; blocks up to the broker's timeouts.
 */
#ifndef STREAM_STREAMER_H
#define STREAM_STREAMER_H

#include <stdint.h>

#include "config/config.h"

struct streamer;

/** @cfg is kept; @report gets one line for each problem, and when it is over. 0; negative with a
 * line in @error: -EINVAL: an option is unusable. Free with streamer_destroy(). */
int streamer_create(const struct config *cfg, void (*report)(const char *line),
		    struct streamer **ret_streamer, char *error, size_t error_bytes);
/** Sends what is collected, if it is connected. */
void streamer_destroy(struct streamer *s);

/** Do what there is to do; how long to wait before the next call, ns. */
int64_t streamer_step(struct streamer *s);

#endif
