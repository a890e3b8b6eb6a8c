/* SPDX-License-Identifier: MIT */
/*
 * Reads a ROS 2 message definition as our recordings have it and decodes messages by it: flat, or
 * with a std_msgs/Header, whose fields are then header.stamp.sec and so on.
 * Whatever the text and the bytes are, nothing is read outside of them. Context: blocking.
 */
#ifndef RECORD_ROS2MSG_H
#define RECORD_ROS2MSG_H

#include <stddef.h>
#include <stdint.h>

enum ros2msg_type { ROS2MSG_BOOL, ROS2MSG_UINT, ROS2MSG_INT, ROS2MSG_FLOAT, ROS2MSG_STRING };

struct ros2msg_field {
	char name[80];
	enum ros2msg_type type;
	uint8_t bytes; /* of the value; a string: of its length */
};

struct ros2msg {
	struct ros2msg_field *field;
	size_t count;
};

struct ros2msg_value {
	uint64_t raw; /* integers and bool: extended to 64 bits; floats: their bits; strings: length
		       */
	const char *text; /* strings: not zero-terminated */
};

/** 0; -ENOTSUP: arrays, other nested types, constants; -EBADMSG; -ENOMEM. Free with
 * ros2msg_done(). */
int ros2msg_parse(const char *text, size_t text_len, struct ros2msg *ret_msg);
void ros2msg_done(struct ros2msg *msg);

/** Decode the little-endian CDR @data to @values (one for each field). 0 or -EBADMSG. */
int ros2msg_decode(const struct ros2msg *msg, const uint8_t *data, size_t data_len,
		   struct ros2msg_value *values);

/** The value as a number. */
double ros2msg_number(const struct ros2msg_field *field, const struct ros2msg_value *value);

/** Index of the field @name; -ENOENT. */
int ros2msg_find(const struct ros2msg *msg, const char *name);

#endif
