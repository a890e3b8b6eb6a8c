/* SPDX-License-Identifier: MIT */
/*
 * What a message of the stream says of its place: numbers in its headers, by which a consumer finds
 * cycles and ecdaq-stream resumes. Context: any.
 */
#ifndef STREAM_MARK_H
#define STREAM_MARK_H

#include <stddef.h>
#include <stdint.h>

enum mark_field {
	MARK_SESSION,     /* of the master */
	MARK_FIRST_CYCLE, /* block: of its first message */
	MARK_NEXT_CYCLE,  /* block: one past that of its last message */
	MARK_EVENT_NEXT,  /* event: one past the newest event of the ring that was sent */
	MARK_EVENT_MONO,  /* event: CLOCK_MONOTONIC of that event, ns */
	MARK_EVENT_TIME,  /* event: its Unix time, ns */
	MARK_FIELDS,
};

struct mark {
	uint64_t value[MARK_FIELDS];
	uint32_t has; /* bit n: enum mark_field n is there */
};

enum { MARK_TEXT_BYTES = 24 };

/** Name of the header: "Ecdaq-Session". */
const char *mark_name(enum mark_field field);
int mark_has(const struct mark *mark, enum mark_field field);
/** @mark with @field. */
void mark_set(struct mark *mark, enum mark_field field, uint64_t value);
void mark_format(const struct mark *mark, enum mark_field field, char buf[MARK_TEXT_BYTES]);
/** Take the header's text, whatever it is: a decimal number of 64 bits, or the field stays unset.
 */
void mark_take(struct mark *mark, enum mark_field field, const char *text);

/** 1 if the headers are those of a block of at least one cycle. */
int mark_is_block(const struct mark *mark);
/** 1 if the event is not among those that @mark covers: it is newer, or of another ring. */
int mark_event_is_new(const struct mark *mark, uint64_t sequence, int64_t mono_ns, int64_t time_ns);

#endif
