/* SPDX-License-Identifier: MIT */
/* The participant with all its topics, writers and the command reader. Context: blocking. */
#ifndef PUBLISH_TOPICS_H
#define PUBLISH_TOPICS_H

#include <stdint.h>

#include "config/config.h"
#include "dds/dds.h"

struct topics {
	dds_entity_t domain;
	dds_entity_t participant;
	dds_entity_t sample;
	dds_entity_t block;
	dds_entity_t channels;
	dds_entity_t status;
	dds_entity_t event;
	dds_entity_t timemap;
	dds_entity_t sync0; /* 0: keys of before this topic do not allow it */
	dds_entity_t idl;
	dds_entity_t command; /* the one reader */
	dds_entity_t reply;
	dds_entity_t ros2_sample; /* 0: there is no mirror */
};

/** 0, or -EIO with one line in @error. Close with topics_close(), also after a failure. */
int topics_open(struct topics *topics, const struct config *cfg, const dds_listener_t *on_command,
		char *error, size_t error_bytes);
void topics_close(struct topics *topics);

/** Write @message with @utc_ns as its source time stamp. 0 or -EIO. Never waits for a reader. */
int topics_write(dds_entity_t writer, const void *message, int64_t utc_ns);
/** The same, stamped with the time now. */
int topics_write_now(dds_entity_t writer, const void *message);

#endif
