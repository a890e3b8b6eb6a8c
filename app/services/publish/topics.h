/* SPDX-License-Identifier: MIT */
/* The participant with all its topics, writers and the command reader. Context: blocking. */
#ifndef PUBLISH_TOPICS_H
#define PUBLISH_TOPICS_H

#include <stdint.h>

#include "config/config.h"
#include "dds/dds.h"
#include "keystore/dds_topics.h"

#define TOPIC_MEMBER(member, ...) dds_entity_t member;

/* A writer for each topic, a reader for the command. 0: not opened, writes to it are dropped. */
struct topics {
	dds_entity_t domain;
	dds_entity_t participant;
	DDS_TOPICS(TOPIC_MEMBER)
};

/**
 * Open all topics; a published one other than ecdaq/sample that the keys do not allow (keys older
 * than the topic) is reported on stderr and left out. 0, or -EIO with one line in @error. Close
 * with topics_close(), also after a failure.
 */
int topics_open(struct topics *topics, const struct config *cfg, const dds_listener_t *on_command,
		char *error, size_t error_bytes);
void topics_close(struct topics *topics);

/** Write @message with @utc_ns as its source time stamp. 0 or -EIO. Never waits for a reader. */
int topics_write(dds_entity_t writer, const void *message, int64_t utc_ns);
/** The same, stamped with the time now. */
int topics_write_now(dds_entity_t writer, const void *message);

#endif
