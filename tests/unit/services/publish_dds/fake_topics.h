/* SPDX-License-Identifier: MIT */
/* publish/topics.h without DDS: commands come from a queue, messages go to a function. */
#ifndef FAKE_TOPICS_H
#define FAKE_TOPICS_H

#include "publish/topics.h"

/* Called for each message; @utc_ns 0: written with the current time. */
typedef void (*fake_writer)(dds_entity_t writer, const void *message, int64_t utc_ns);

/** Topics with an entity each; messages go to @on_write. Forgets queued commands. */
struct topics fake_topics(fake_writer on_write);

/** Queue a copy of @command as if @sender had written it. */
void fake_topics_command(const ecdaq_CommandV1 *command, uint64_t sender);

#endif
