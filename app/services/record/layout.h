/* SPDX-License-Identifier: MIT */
/*
 * How a sample becomes messages: from the channel table in the ring's meta area, one topic a slave
 * with its fields, and the texts that describe them (ROS 2 message definition, IDL, JSON).
 */
#ifndef RECORD_LAYOUT_H
#define RECORD_LAYOUT_H

#include <stddef.h>
#include <stdint.h>

#include "base/sample.h"
#include "reader/table.h"

struct layout;

enum layout_limits {
	LAYOUT_NAME_BYTES = 80,
	LAYOUT_HEAD_FIELDS = 4, /* cycle, dc_time_ns, flags, good: in each slave's message before
				   its channels */
};

/* One field of a slave's message. */
struct layout_field {
	char name[LAYOUT_NAME_BYTES]; /* as ROS 2 allows: a-z 0-9 and single _ */
	const char *ros_type;         /* "uint16" */
	const char *idl_type;         /* "unsigned short" */
	uint8_t bytes;                /* in CDR */
	const struct channel *channel;
};

struct layout_topic {
	char topic[LAYOUT_NAME_BYTES]; /* "/ecdaq/piccolo0" */
	char type[LAYOUT_NAME_BYTES];  /* "Piccolo0" */
	const struct slave_info *slave;
	const struct layout_field *field;
	size_t field_count;
	size_t message_bytes; /* of its CDR */
};

/** @table is kept by the caller. 0, or -ENOMEM. Free with layout_destroy(). Context: blocking. */
int layout_create(const struct channel_table *table, struct layout **ret_layout);
void layout_destroy(struct layout *l);

const struct sample_meta *layout_meta(const struct layout *l);
const struct slave_info *layout_slaves(const struct layout *l);
/** Topics: one for each slave that has channels. */
const struct layout_topic *layout_topics(const struct layout *l, size_t *ret_count);
/** Bytes of the largest slave message, and of all of one cycle together. */
size_t layout_largest_bytes(const struct layout *l);
size_t layout_cycle_bytes(const struct layout *l);

/** The slave's message of the sample @header with @image to @buf. Returns its length. Context: any,
 * RT-safe. */
size_t layout_encode(const struct layout_topic *topic, const struct sample_header *header,
		     const uint8_t *image, uint8_t *buf, size_t buf_len);

/* Texts; free() them. NULL without memory. */
char *layout_ros2msg(const struct layout_topic *topic);
char *layout_idl(const struct layout *l);
char *layout_json(const struct layout *l);

#endif
