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
#include "config/config.h"
#include "image/field.h"
#include "reader/table.h"

struct layout;

enum layout_limits {
	LAYOUT_NAME_BYTES = 80,
	LAYOUT_HEAD_FIELDS = 5, /* header, cycle, dc_time_ns, flags, good: in each slave's message
				   before its channels */
};

/* One field of a slave's message. A channel with a scale or an offset has a physical field, a raw
 * one, or both (record.values); any other one has a raw field, which is its value as well. */
struct layout_field {
	char name[LAYOUT_NAME_BYTES]; /* as ROS 2 allows: a-z 0-9 and single _ */
	const char *ros_type;         /* "uint16" */
	const char *idl_type;         /* "unsigned short" */
	uint8_t bytes;                /* in CDR */
	uint32_t at;                  /* where in the message */
	struct image_field image;     /* where in the process image */
	uint64_t sign;                /* raw: its highest bit, if it has a sign */
	uint8_t is_copied;            /* raw: the same octets as in the process image */
	const struct channel *channel;
	const char *raw_name; /* physical: the raw field of the same channel, "" without one. NULL:
				 it is raw */
};

/** 1 if the next field is the raw one of the same channel. */
static inline int layout_has_raw_beside(const struct layout_field *f)
{
	return f->raw_name != NULL && f->raw_name[0] != '\0';
}

struct layout_topic {
	char topic[LAYOUT_NAME_BYTES]; /* "/ecdaq/piccolo0" */
	char type[LAYOUT_NAME_BYTES];  /* "Piccolo0" */
	const struct slave_info *slave;
	const struct layout_field *field;
	size_t field_count;
	size_t message_bytes; /* of its CDR */
};

/** @table is kept by the caller. 0, or -ENOMEM. Free with layout_destroy(). Context: blocking. */
int layout_create(const struct channel_table *table, enum config_record_values values,
		  struct layout **ret_layout);
void layout_destroy(struct layout *l);

const struct sample_meta *layout_meta(const struct layout *l);
const struct slave_info *layout_slaves(const struct layout *l);
/** Topics: one for each slave that has channels. */
const struct layout_topic *layout_topics(const struct layout *l, size_t *ret_count);
/** Bytes of the largest slave message, and of all of one cycle together. */
size_t layout_largest_bytes(const struct layout *l);
size_t layout_cycle_bytes(const struct layout *l);

/** The slave's message of the sample @header with @image, taken at @utc_ns, to @buf. A physical
 * value of a sample that is not good is NaN. Returns its length. Context: any, RT-safe. */
size_t layout_encode(const struct layout_topic *topic, const struct sample_header *header,
		     const uint8_t *image, uint64_t utc_ns, uint8_t *buf, size_t buf_len);

/* Texts; free() them. NULL without memory. */
char *layout_ros2msg(const struct layout_topic *topic);
char *layout_idl(const struct layout *l);
char *layout_json(const struct layout *l);

#endif
