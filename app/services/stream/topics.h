/* SPDX-License-Identifier: MIT */
/*
 * The slaves of one session as topics of the stream, from a layout (ring) or from the head of a
 * recording; and the document that describes them to consumers. Context: blocking.
 */
#ifndef STREAM_TOPICS_H
#define STREAM_TOPICS_H

#include <stddef.h>
#include <stdint.h>

#include "record/layout.h"

struct topic {
	char name[LAYOUT_NAME_BYTES];   /* "piccolo0": token of the subject */
	char schema[LAYOUT_NAME_BYTES]; /* "ecdaq_msgs/msg/Piccolo0" */
	char *text;                     /* its ROS 2 message definition */
};

struct topics {
	uint64_t session;
	struct topic *topic;
	size_t count;
	size_t capacity;
	char *layout_json; /* slaves and channels, as recordings have it */
};

enum { TOPICS_LIMIT = 512 };

/** The topic token of the channel @topic_name, "/ecdaq/piccolo0"; NULL: it is not a slave's. */
const char *topics_token(const char *topic_name);

/** Append a topic; texts are copied. Index; -ENOMEM, -E2BIG, -EINVAL: not a token. */
int topics_add(struct topics *t, const char *token, const char *schema, const char *text);
/** All of @layout into the empty @t. 0, -ENOMEM. */
int topics_of_layout(struct topics *t, const struct layout *layout);
void topics_done(struct topics *t);

/** The document on ecdaq.APPLIANCE.channels, JSON; free() it. NULL without memory. */
char *topics_document(const struct topics *t, const char *appliance);

#endif
