/* SPDX-License-Identifier: MIT */
/*
 * The cyclic frames as buffers that are built once: offsets of their datagrams, the sequence
 * written in each cycle, the match of a returned frame. Context: cycle thread, but for
 * exchange_frame_build().
 */
#ifndef BUS_EXCHANGE_FRAME_H
#define BUS_EXCHANGE_FRAME_H

#include <stddef.h>
#include <stdint.h>

#include "base/limits.h"
#include "bus/exchange_plan.h"

enum {
	EXCHANGE_OVERHEAD = 12, /* header and WKC of a datagram */
	EXCHANGE_DC_BYTES = 8,
	EXCHANGE_AL_BYTES = 2,
	EXCHANGE_DIFF_BYTES = 4,
	EXCHANGE_NOP_BYTES = 2,
	EXCHANGE_NUMBERED = 2, /* datagrams whose index bytes carry the sequence */
	/* Datagrams of one byte that a frame has room for. */
	EXCHANGE_PARTS = LIMIT_FRAME_BYTES / (EXCHANGE_OVERHEAD + 1),
};

/* One datagram of process data: a chunk of the process image. */
struct exchange_part {
	size_t at;       /* as below */
	uint32_t offset; /* of its data in the process image */
	uint32_t len;
	unsigned chunk; /* in the plan */
};

/* Offsets in bytes of a datagram's header from the frame's first byte; 0: it has none of that kind.
 */
struct exchange_frame {
	uint8_t bytes[LIMIT_FRAME_BYTES];
	size_t len;
	size_t datagram[EXCHANGE_NUMBERED]; /* the first ones */
	unsigned datagram_count;
	struct exchange_part part[EXCHANGE_PARTS];
	unsigned part_count;
	size_t dc;        /* FRMW or FPRD of 0x0910 */
	size_t al;        /* BRD of 0x0130 */
	size_t diff;      /* BRD of 0x092C */
	size_t mailboxes; /* LRD of their states */
};

/** How many process data bytes fit into frame @number of @plan, in one datagram; each further one
 * takes EXCHANGE_OVERHEAD of them. */
uint32_t exchange_frame_capacity(const struct exchange_plan *plan, unsigned number);

/** Length of frame @number, from its Ethernet header on, without FCS. */
size_t exchange_frame_bytes(const struct exchange_plan *plan, unsigned number);

/** Build frame @number. 0, or -E2BIG if the plan's chunk does not fit. */
int exchange_frame_build(const struct exchange_plan *plan, unsigned number,
			 struct exchange_frame *ret);

/** The exchange sequence goes low byte first into the index bytes of the first two datagrams. */
void exchange_frame_number(struct exchange_frame *ef, uint16_t sequence);

/** 1 and the sequence it carries, if @frame is a returned @ef of any cycle; else 0. */
int exchange_frame_matches(const struct exchange_frame *ef, uint8_t *frame, size_t frame_len,
			   uint16_t *ret_sequence);

static inline uint8_t *exchange_data(uint8_t *frame, size_t datagram)
{
	return frame + datagram + 10;
}

uint16_t exchange_wkc(const uint8_t *frame, size_t datagram);

#endif
