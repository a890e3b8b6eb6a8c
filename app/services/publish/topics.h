/* SPDX-License-Identifier: MIT */
/* The participant with all its topics, writers and the command reader. Context: blocking. */
#ifndef PUBLISH_TOPICS_H
#define PUBLISH_TOPICS_H

#include <stdint.h>

#include "config/config.h"
#include "dds/dds.h"
#include "ecdaq.h"
#include "keystore/dds_topics.h"

#define TOPIC_MEMBER(member, ...) dds_entity_t member;

/* A writer for each topic, a reader for the command. 0: not opened, writes to it are dropped. */
struct topics {
	dds_entity_t domain;
	dds_entity_t participant;
	dds_entity_t waitset;
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

/** Write @message with @utc_ns as its source timestamp. 0 or -EIO. Never blocks on a reader. */
int topics_write(dds_entity_t writer, const void *message, int64_t utc_ns);
/** The same with the current time. */
int topics_write_now(dds_entity_t writer, const void *message);

/** 1 and the next command with its writer, to be freed with ecdaq_CommandV1_free(); 0: none. */
int topics_take_command(const struct topics *topics, ecdaq_CommandV1 **ret_command,
			uint64_t *ret_sender);

/** Return when a command has arrived, or after @timeout_ns. */
void topics_wait(const struct topics *topics, int64_t timeout_ns);

/** How many readers are matched with @writer. */
uint32_t topics_reader_count(dds_entity_t writer);

#endif
