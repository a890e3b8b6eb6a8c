/* SPDX-License-Identifier: MIT */
#include "stream/lanes.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Behind by this many blocks, one message carries them all. */
enum { BLOCKS_AT_MOST = 10, FIRST_CYCLES = 16 };

struct lane {
	char subject[BROKER_SUBJECT_BYTES];
	struct lane_start start;
	uint64_t first_cycle; /* of the block */
	uint64_t count;       /* of its cycles */
	uint8_t *data;
	size_t len;
	size_t capacity;
};

struct lanes {
	struct lane *lane;
	size_t count;
	uint64_t session;
	struct lanes_bounds bounds;
	size_t memory_bytes; /* of all blocks */
	uint64_t longest;    /* cycles of the longest block */
	int is_full;         /* by bytes */
};

int lanes_create(const struct topics *topics, const char *appliance, struct lanes **ret_lanes)
{
	struct lanes *l = calloc(1, sizeof(*l));

	if (l == NULL) {
		return -ENOMEM;
	}
	l->lane = calloc(topics->count > 0 ? topics->count : 1, sizeof(l->lane[0]));
	if (l->lane == NULL) {
		free(l);
		return -ENOMEM;
	}
	l->count = topics->count;
	l->session = topics->session;
	for (size_t i = 0; i < l->count; i++) {
		snprintf(l->lane[i].subject, sizeof(l->lane[i].subject), "ecdaq.%s.%s.block",
			 appliance, topics->topic[i].name);
	}
	*ret_lanes = l;
	return 0;
}

void lanes_destroy(struct lanes *l)
{
	if (l != NULL) {
		for (size_t i = 0; i < l->count; i++) {
			free(l->lane[i].data);
		}
		free(l->lane);
		free(l);
	}
}

size_t lanes_count(const struct lanes *l)
{
	return l->count;
}

const char *lanes_subject(const struct lanes *l, size_t lane)
{
	return l->lane[lane].subject;
}

void lanes_start(struct lanes *l, size_t lane, struct lane_start start)
{
	l->lane[lane].start = start;
	l->lane[lane].count = 0;
	l->lane[lane].len = 0;
}

uint64_t lanes_next_cycle(const struct lanes *l)
{
	uint64_t lowest = UINT64_MAX;

	for (size_t i = 0; i < l->count; i++) {
		uint64_t next = l->lane[i].start.next_cycle;

		lowest = next < lowest ? next : lowest;
	}
	return lowest;
}

void lanes_set_bounds(struct lanes *l, const struct lanes_bounds *bounds)
{
	l->bounds = *bounds;
}

/* Room for @len bytes more, grown within what all blocks may have together. */
static int make_room(struct lanes *l, struct lane *lane, size_t len)
{
	size_t wanted = lane->capacity > 0 ? lane->capacity : FIRST_CYCLES * len;
	uint8_t *more;

	if (lane->len + len <= lane->capacity) {
		return 0;
	}
	while (wanted < lane->len + len) {
		wanted *= 2;
	}
	wanted = wanted > l->bounds.payload_bytes ? l->bounds.payload_bytes : wanted;
	if (l->memory_bytes - lane->capacity + wanted > l->bounds.memory_bytes && lane->count > 0) {
		return -EAGAIN;
	}
	more = realloc(lane->data, wanted);
	if (more == NULL) {
		return -ENOMEM;
	}
	l->memory_bytes += wanted - lane->capacity;
	lane->data = more;
	lane->capacity = wanted;
	return 0;
}

int lanes_add(struct lanes *l, size_t lane_index, uint64_t cycle, const void *data, size_t len)
{
	struct lane *lane = &l->lane[lane_index];
	int r;

	if (cycle < lane->start.next_cycle ||
	    (lane->count > 0 && cycle < lane->first_cycle + lane->count)) {
		return 0;
	}
	if (len > l->bounds.payload_bytes) {
		return -EMSGSIZE;
	}
	/* Messages of a block are of one size: a consumer divides. */
	if (lane->count > 0 &&
	    (cycle != lane->first_cycle + lane->count || len * lane->count != lane->len ||
	     lane->len + len > l->bounds.payload_bytes)) {
		r = -EAGAIN;
	} else {
		r = make_room(l, lane, len);
	}
	if (r < 0) {
		l->is_full = 1;
		return r;
	}
	if (lane->count == 0) {
		lane->first_cycle = cycle;
	}
	memcpy(lane->data + lane->len, data, len);
	lane->len += len;
	lane->count++;
	l->longest = lane->count > l->longest ? lane->count : l->longest;
	return 0;
}

int lanes_are_due(const struct lanes *l)
{
	return l->longest >= l->bounds.block_cycles;
}

int lanes_are_full(const struct lanes *l)
{
	return l->is_full || l->longest >= (uint64_t)BLOCKS_AT_MOST * l->bounds.block_cycles;
}

size_t lanes_messages(struct lanes *l, struct broker_message *message)
{
	size_t n = 0;

	for (size_t i = 0; i < l->count; i++) {
		const struct lane *lane = &l->lane[i];
		struct broker_message *m = &message[n];

		if (lane->count == 0) {
			continue;
		}
		*m = (struct broker_message){ .subject = lane->subject,
					      .after = lane->start.sequence,
					      .data = lane->data,
					      .len = lane->len };
		snprintf(m->id, sizeof(m->id), "%" PRIu64 "-%zu-%" PRIu64, l->session, i,
			 lane->first_cycle);
		mark_set(&m->mark, MARK_SESSION, l->session);
		mark_set(&m->mark, MARK_FIRST_CYCLE, lane->first_cycle);
		mark_set(&m->mark, MARK_NEXT_CYCLE, lane->first_cycle + lane->count);
		n++;
	}
	return n;
}

size_t lanes_stored(struct lanes *l, const struct broker_message *message, size_t count)
{
	size_t bytes = 0;
	size_t n = 0;

	for (size_t i = 0; i < l->count && n < count; i++) {
		struct lane *lane = &l->lane[i];

		if (lane->count == 0) {
			continue;
		}
		bytes += lane->len;
		lanes_start(l, i,
			    (struct lane_start){ .sequence = message[n++].sequence,
						 .next_cycle = lane->first_cycle + lane->count });
	}
	l->longest = 0;
	l->is_full = 0;
	return bytes;
}
