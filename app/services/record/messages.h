/* SPDX-License-Identifier: MIT */
/*
 * The messages that every recording has, whatever its slaves: cycle, event, time map. Each is one
 * table of fields that its definition and its IDL are made from.
 */
#ifndef RECORD_MESSAGES_H
#define RECORD_MESSAGES_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "base/event.h"
#include "base/sample.h"
#include "base/sync0.h"
#include "base/timemap.h"

#define MESSAGES_PACKAGE "ecdaq_msgs"

enum messages_kind { MESSAGE_CYCLE, MESSAGE_EVENT, MESSAGE_TIMEMAP, MESSAGE_SYNC0, MESSAGE_KINDS };
enum { MESSAGES_LARGEST_BYTES = 1024 };

/** "/ecdaq/cycle" */
const char *messages_topic(enum messages_kind kind);
/** "Cycle" */
const char *messages_type(enum messages_kind kind);
int messages_has_topic(const char *topic);
int messages_has_type(const char *type);

/** The ROS 2 definition; and the struct in IDL, inside its module. */
void messages_put_ros2msg(enum messages_kind kind, FILE *out);
void messages_put_idl(enum messages_kind kind, FILE *out);
/** The ROS 2 definition as a text; free() it. NULL without memory. */
char *messages_ros2msg(enum messages_kind kind);
/** Name of the schema of @type (messages_type(), layout_topic.type): "ecdaq_msgs/msg/Cycle". */
void messages_schema_name(const char *type, char *buf, size_t buf_len);

/* An event as it is recorded: with its place in the event ring, and its text. */
struct messages_event {
	struct event event;
	uint64_t sequence; /* in the event ring; UINT64_MAX: made by the recorder */
	int64_t utc_ns;
	const char *text;
};

/* CDR into @buf of MESSAGES_LARGEST_BYTES. Return the length. @slave_count: 0 to LIMIT_SLAVES.
 * Context: any. */
size_t messages_encode_cycle(const struct sample_header *header, uint32_t slave_count,
			     uint8_t *buf);
size_t messages_encode_event(const struct messages_event *ev, uint8_t *buf);
size_t messages_encode_timemap(const struct timemap_state *state, uint8_t *buf);
size_t messages_encode_sync0(const struct sync0_result *result, int64_t utc_ns, uint8_t *buf);

/** What tells where a recording ends: of a cycle (or slave) message, of an event message. 0,
 * -EBADMSG. */
int messages_decode_cycle(const uint8_t *data, size_t data_len, uint64_t *ret_cycle);
int messages_decode_event(const uint8_t *data, size_t data_len, uint64_t *ret_sequence,
			  int64_t *ret_mono_ns);
/** The cycle of an event message. 0, -EBADMSG. */
int messages_decode_event_cycle(const uint8_t *data, size_t data_len, uint64_t *ret_cycle);

#endif
