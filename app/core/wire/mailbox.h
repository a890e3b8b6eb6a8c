/* SPDX-License-Identifier: MIT */
/*
 * The mailbox header and the error reply (ETG.1000.4 part 5.6): what every mailbox message starts
 * with, whatever its protocol. Context: any, RT-safe.
 */
#ifndef WIRE_MAILBOX_H
#define WIRE_MAILBOX_H

#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"

enum {
	MAILBOX_BYTES = 1486, /* the largest mailbox: one datagram of one frame */
	MAILBOX_HEADER_BYTES = 6,
	MAILBOX_ERROR_BYTES = 4, /* data of an error reply */
	MAILBOX_COUNTER_MAX = 7, /* counters run 1 to 7; 0 is a sender that does not count */
};

enum mailbox_type {
	MAILBOX_TYPE_ERROR = 0,
	MAILBOX_TYPE_AOE = 1,
	MAILBOX_TYPE_EOE = 2,
	MAILBOX_TYPE_COE = 3,
	MAILBOX_TYPE_FOE = 4,
	MAILBOX_TYPE_SOE = 5,
	MAILBOX_TYPE_VOE = 15,
};

/* Detail of an error reply. */
enum mailbox_error {
	MAILBOX_ERROR_SYNTAX = 1,
	MAILBOX_ERROR_UNSUPPORTED_PROTOCOL = 2,
	MAILBOX_ERROR_INVALID_CHANNEL = 3,
	MAILBOX_ERROR_SERVICE_NOT_SUPPORTED = 4,
	MAILBOX_ERROR_INVALID_HEADER = 5,
	MAILBOX_ERROR_SIZE_TOO_SHORT = 6,
	MAILBOX_ERROR_NO_MEMORY = 7,
	MAILBOX_ERROR_INVALID_SIZE = 8,
	MAILBOX_ERROR_SERVICE_IN_WORK = 9,
};

struct mailbox_header {
	uint16_t data_len; /* behind the header */
	uint16_t address;  /* station address of the other side; 0: the master */
	uint8_t priority;  /* 0 lowest to 3; the channel in bits 0 to 5 is reserved and 0 */
	uint8_t type;      /* enum mailbox_type, 4 bits */
	uint8_t counter;   /* 0 to MAILBOX_COUNTER_MAX */
};

static inline struct mailbox_header mailbox_header_get(const uint8_t *p)
{
	return (struct mailbox_header){ .data_len = get_le16(p),
					.address = get_le16(p + 2),
					.priority = p[4] >> 6,
					.type = p[5] & 0x0f,
					.counter = p[5] >> 4 & MAILBOX_COUNTER_MAX };
}

static inline void mailbox_header_put(uint8_t *p, const struct mailbox_header *h)
{
	put_le16(p, h->data_len);
	put_le16(p + 2, h->address);
	p[4] = (uint8_t)(h->priority << 6);
	p[5] = (uint8_t)((h->type & 0x0f) | h->counter << 4);
}

/** 1 to 7, then 1 again. */
static inline uint8_t mailbox_counter_next(uint8_t counter)
{
	return (uint8_t)(counter % MAILBOX_COUNTER_MAX + 1);
}

/** Detail of the error reply in @data (without the header); 0: it is none. */
static inline uint16_t mailbox_error_get(const uint8_t *data, size_t data_len)
{
	return data_len >= MAILBOX_ERROR_BYTES && get_le16(data) == 1 ? get_le16(data + 2) : 0;
}

/** MAILBOX_ERROR_BYTES of an error reply. */
static inline void mailbox_error_put(uint8_t *data, enum mailbox_error error)
{
	put_le16(data, 1);
	put_le16(data + 2, (uint16_t)error);
}

/** "CoE", "FoE", ...; "unknown" for a type that has no protocol. */
const char *mailbox_type_to_str(unsigned type);
/** Text of an error reply's detail; "unknown" for one that ETG.1000.4 does not list. */
const char *mailbox_error_to_str(unsigned error);

#endif
