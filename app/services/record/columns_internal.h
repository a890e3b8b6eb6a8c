/* SPDX-License-Identifier: MIT */
/* Inside of the table: what columns.c gathers and columns_put.c prints. */
#ifndef RECORD_COLUMNS_INTERNAL_H
#define RECORD_COLUMNS_INTERNAL_H

#include "record/columns.h"
#include "record/ros2msg.h"

enum { COLUMN_NAME_BYTES = 192 };

struct column {
	char name[COLUMN_NAME_BYTES];
	size_t topic;
	size_t field;
	double scale;
	double offset;
};

struct topic {
	uint16_t id;
	struct ros2msg msg;
	struct ros2msg_value *value; /* of the newest message */
	uint64_t cycle;              /* of that */
	int is_fresh;                /* it belongs to the row */
};

struct schema {
	uint16_t id;
	char *text;
	size_t text_len;
};

struct columns {
	const char *channels;
	int is_raw;
	enum log_format format;
	struct schema *schema;
	size_t schema_count;
	struct topic *topic;
	size_t topic_count;
	struct column *column;
	size_t column_count;
	int cycle_channel; /* -1: none */
	int is_frozen;
	int has_row;
	struct {
		uint64_t cycle;
		uint64_t utc_ns;
		int64_t dc_time_ns;
		uint32_t flags;
	} row;
};

#endif
