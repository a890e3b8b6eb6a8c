/* SPDX-License-Identifier: MIT */
/*
 * The blocks that are being filled, one for each slave of a session. A block is a run of cycles
 * without a gap; its payload is the recording's messages of these cycles, one after the other. What
 * the stream has is not taken again. Context: one thread; allocates in lanes_create() only.
 */
#ifndef STREAM_LANES_H
#define STREAM_LANES_H

#include <stddef.h>
#include <stdint.h>

#include "stream/broker.h"
#include "stream/topics.h"

struct lanes;

/* What the stream says of one subject. */
struct lane_start {
	uint64_t sequence;   /* of the newest message, 0: none */
	uint64_t next_cycle; /* to be sent next; 0: all; UINT64_MAX: none, it has a later session */
};

/** @appliance and the texts of @topics are copied. 0, -ENOMEM. Free with lanes_destroy(). */
int lanes_create(const struct topics *topics, const char *appliance, struct lanes **ret_lanes);
void lanes_destroy(struct lanes *l);

size_t lanes_count(const struct lanes *l);
const char *lanes_subject(const struct lanes *l, size_t lane);
/** Continue the lane there; its block is emptied. */
void lanes_start(struct lanes *l, size_t lane, struct lane_start start);
/** The lowest cycle that some lane has to send next: 0: all from the first; UINT64_MAX: none. */
uint64_t lanes_next_cycle(const struct lanes *l);

/* How far blocks are filled. */
struct lanes_bounds {
	uint32_t block_cycles; /* a block of so many cycles is due */
	size_t payload_bytes;  /* of the largest message */
	size_t memory_bytes;   /* of all blocks together */
};

void lanes_set_bounds(struct lanes *l, const struct lanes_bounds *bounds);

/**
 * Append a message of @cycle, copied. 0: taken, or the stream has it; -EAGAIN: the block must be
 * sent before, it is full or @cycle is not its next one; -EMSGSIZE: longer than a payload may be;
 * -ENOMEM.
 */
int lanes_add(struct lanes *l, size_t lane, uint64_t cycle, const void *data, size_t len);
/** 1 if the longest block has block_cycles or more; and if nothing more should be added. */
int lanes_are_due(const struct lanes *l);
int lanes_are_full(const struct lanes *l);

/** The blocks that are not empty: at most lanes_count() messages, valid until the next change. */
size_t lanes_messages(struct lanes *l, struct broker_message *message);
/** All of these were stored. Returns the bytes of their payloads. */
size_t lanes_stored(struct lanes *l, const struct broker_message *message, size_t count);

#endif
