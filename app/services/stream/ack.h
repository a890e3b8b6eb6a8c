/* SPDX-License-Identifier: MIT */
/* The answer of JetStream to a published message, whatever its bytes are. Context: any. */
#ifndef STREAM_ACK_H
#define STREAM_ACK_H

#include <stddef.h>
#include <stdint.h>

enum { ACK_REASON_BYTES = 160 };

enum ack_result {
	ACK_STORED,    /* sequence */
	ACK_DUPLICATE, /* a message with this id is in the stream; sequence: its own */
	ACK_REJECTED,  /* reason */
	ACK_INVALID,   /* no such answer */
};

struct ack {
	enum ack_result result;
	uint64_t sequence;
	char reason[ACK_REASON_BYTES]; /* printable ASCII, one line */
};

/** Read the @len bytes at @text. */
void ack_parse(const char *text, size_t len, struct ack *ret);

#endif
