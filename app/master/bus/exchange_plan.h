/* SPDX-License-Identifier: MIT */
/* How the process image is cut into the datagrams and frames of one exchange. */
#ifndef BUS_EXCHANGE_PLAN_H
#define BUS_EXCHANGE_PLAN_H

#include <stdint.h>

#include "base/limits.h"
#include "base/slave_set.h"

/* The command of a process data datagram. */
enum exchange_kind {
	EXCHANGE_LRW,
	EXCHANGE_LWR, /* outputs only, and */
	EXCHANGE_LRD, /* inputs only, where a slave must not be sent LRW */
};

struct exchange_plan {
	uint32_t image_bytes;
	uint32_t output_bytes; /* the first of them */
	uint32_t logical_start;
	uint32_t chunk_bytes[LIMIT_CHUNKS]; /* how the image is cut into datagrams */
	unsigned chunk_count;
	uint8_t chunk_kind[LIMIT_CHUNKS];            /* enum exchange_kind */
	uint16_t chunk_wkc[LIMIT_CHUNKS];            /* expected of each */
	uint8_t chunk_frame[LIMIT_CHUNKS];           /* which frame carries it, ascending */
	struct slave_set chunk_slaves[LIMIT_CHUNKS]; /* whose data it has */
	uint16_t wkc_expected;                       /* sum, with every slave in SAFE-OP or OP */
	uint16_t mailbox_bits;                       /* mailbox states behind the image; 0: none */
	uint16_t dc_reference; /* station address of the reference clock; 0: no DC */
	uint16_t slave_count;
	int is_split; /* 1: a chunk a slave; those with a good WKC are taken though others have not
		       */
	int monitor;  /* 1: BRD of AL status and DC difference */
};

/** Bytes of the mailbox states. */
static inline uint32_t exchange_mailbox_bytes(const struct exchange_plan *plan)
{
	return (plan->mailbox_bits + 7u) / 8;
}

/** How many frames an exchange has. */
static inline unsigned exchange_frame_count(const struct exchange_plan *plan)
{
	return plan->chunk_count > 0 ? plan->chunk_frame[plan->chunk_count - 1] + 1u : 1;
}

#endif
