/* SPDX-License-Identifier: MIT */
#include "record/ros2msg.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "record/cdr.h"

enum { FIELDS_MOST = 65536 };

static const struct {
	const char *name;
	enum ros2msg_type type;
	uint8_t bytes;
} types[] = {
	{ "bool", ROS2MSG_BOOL, 1 },     { "byte", ROS2MSG_UINT, 1 },
	{ "char", ROS2MSG_UINT, 1 },     { "uint8", ROS2MSG_UINT, 1 },
	{ "uint16", ROS2MSG_UINT, 2 },   { "uint32", ROS2MSG_UINT, 4 },
	{ "uint64", ROS2MSG_UINT, 8 },   { "int8", ROS2MSG_INT, 1 },
	{ "int16", ROS2MSG_INT, 2 },     { "int32", ROS2MSG_INT, 4 },
	{ "int64", ROS2MSG_INT, 8 },     { "float32", ROS2MSG_FLOAT, 4 },
	{ "float64", ROS2MSG_FLOAT, 8 }, { "string", ROS2MSG_STRING, 4 },
};

/* The next word of the line; 0 at its end or at a comment. */
static size_t take_word(const char **at, const char *end, const char **ret_word)
{
	size_t len = 0;

	while (*at < end && (**at == ' ' || **at == '\t' || **at == '\r')) {
		(*at)++;
	}
	*ret_word = *at;
	while (*at < end && **at != ' ' && **at != '\t' && **at != '\r' && **at != '#') {
		(*at)++;
		len++;
	}
	return len;
}

static int is_word(const char *word, size_t len, const char *text)
{
	return strlen(text) == len && memcmp(word, text, len) == 0;
}

static int find_type(const char *word, size_t len, struct ros2msg_field *field)
{
	for (size_t i = 0; i < sizeof(types) / sizeof(types[0]); i++) {
		if (is_word(word, len, types[i].name)) {
			field->type = types[i].type;
			field->bytes = types[i].bytes;
			return 0;
		}
	}
	return -ENOTSUP;
}

/* std_msgs/Header as the fields that it has. The definition of that follows behind a separator. */
static const struct ros2msg_field header_fields[] = {
	{ "stamp.sec", ROS2MSG_INT, 4 },
	{ "stamp.nanosec", ROS2MSG_UINT, 4 },
	{ "frame_id", ROS2MSG_STRING, 4 },
};

static int append(struct ros2msg *msg, const struct ros2msg_field *field)
{
	struct ros2msg_field *grown;

	if (msg->count == FIELDS_MOST) {
		return -ENOTSUP;
	}
	if ((msg->count & (msg->count - 1)) == 0) { /* full at each power of two */
		grown = realloc(msg->field,
				(msg->count == 0 ? 1 : msg->count * 2) * sizeof(msg->field[0]));
		if (grown == NULL) {
			return -ENOMEM;
		}
		msg->field = grown;
	}
	msg->field[msg->count++] = *field;
	return 0;
}

static int append_header(struct ros2msg *msg, const char *name)
{
	int r = 0;

	for (size_t i = 0; i < sizeof(header_fields) / sizeof(header_fields[0]) && r == 0; i++) {
		struct ros2msg_field field = header_fields[i];

		if ((size_t)snprintf(field.name, sizeof(field.name), "%s.%s", name,
				     header_fields[i].name) >= sizeof(field.name)) {
			return -EBADMSG;
		}
		r = append(msg, &field);
	}
	return r;
}

/* The field of this line, if it has one. */
static int parse_line(const char *at, const char *end, struct ros2msg *msg)
{
	struct ros2msg_field field = { .name = "" };
	const char *word;
	size_t len = take_word(&at, end, &word);
	int is_header = is_word(word, len, "std_msgs/Header");
	int r = len == 0 || is_header ? 0 : find_type(word, len, &field);

	if (len == 0 || r < 0) {
		return r;
	}
	len = take_word(&at, end, &word);
	if (len == 0 || len >= sizeof(field.name)) {
		return -EBADMSG;
	}
	memcpy(field.name, word, len);
	if (memchr(field.name, '=', len) != NULL || take_word(&at, end, &word) > 0) {
		return -ENOTSUP; /* a constant or a default */
	}
	return is_header ? append_header(msg, field.name) : append(msg, &field);
}

int ros2msg_parse(const char *text, size_t text_len, struct ros2msg *ret_msg)
{
	struct ros2msg msg = { .field = NULL };
	const char *end = text + text_len;
	int r = 0;

	while (text < end && r == 0 && *text != '=') { /* a separator: nested definitions */
		const char *line_end = memchr(text, '\n', (size_t)(end - text));

		line_end = line_end != NULL ? line_end : end;
		r = parse_line(text, line_end, &msg);
		text = line_end < end ? line_end + 1 : end;
	}
	if (r < 0) {
		ros2msg_done(&msg);
		return r;
	}
	*ret_msg = msg;
	return 0;
}

void ros2msg_done(struct ros2msg *msg)
{
	free(msg->field);
	*msg = (struct ros2msg){ .field = NULL };
}

static uint64_t extend_sign(uint64_t raw, size_t bytes)
{
	uint64_t sign = UINT64_C(1) << (8 * bytes - 1);

	return bytes < 8 ? (raw ^ sign) - sign : raw;
}

int ros2msg_decode(const struct ros2msg *msg, const uint8_t *data, size_t data_len,
		   struct ros2msg_value *values)
{
	size_t at = CDR_HEADER_BYTES;

	if (data_len < CDR_HEADER_BYTES || data[0] != 0 || data[1] != 1) {
		return -EBADMSG;
	}
	for (size_t i = 0; i < msg->count; i++) {
		const struct ros2msg_field *f = &msg->field[i];
		uint64_t raw;

		at = cdr_align(at, f->bytes);
		if (at > data_len || f->bytes > data_len - at) {
			return -EBADMSG;
		}
		raw = get_le(data + at, (unsigned)f->bytes);
		at += f->bytes;
		values[i] = (struct ros2msg_value){ .raw = raw, .text = NULL };
		if (f->type == ROS2MSG_INT) {
			values[i].raw = extend_sign(raw, f->bytes);
		} else if (f->type == ROS2MSG_STRING) {
			if (raw > data_len - at) {
				return -EBADMSG;
			}
			values[i].text = (const char *)data + at;
			values[i].raw = raw > 0 ? raw - 1 : 0; /* without the closing zero */
			at += raw;
		}
	}
	return 0;
}

double ros2msg_number(const struct ros2msg_field *field, const struct ros2msg_value *value)
{
	uint32_t bits = (uint32_t)value->raw;
	double wide;
	float narrow;

	switch (field->type) {
	case ROS2MSG_BOOL:
	case ROS2MSG_UINT:
	case ROS2MSG_STRING:
		return (double)value->raw;
	case ROS2MSG_INT:
		return (double)(int64_t)value->raw;
	case ROS2MSG_FLOAT:
		if (field->bytes == 4) {
			memcpy(&narrow, &bits, sizeof(narrow));
			return (double)narrow;
		}
		memcpy(&wide, &value->raw, sizeof(wide));
		return wide;
	}
	return 0;
}

int ros2msg_find(const struct ros2msg *msg, const char *name)
{
	for (size_t i = 0; i < msg->count; i++) {
		if (strcmp(msg->field[i].name, name) == 0) {
			return (int)i;
		}
	}
	return -ENOENT;
}
