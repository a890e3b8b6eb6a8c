/* SPDX-License-Identifier: MIT */
/*
 * The admin socket of ecdaqd ("admin" in the run directory, SOCK_SEQPACKET, mode 0660, group from
 * configuration): one fixed-size request, one fixed-size reply. Little-endian hosts only; both ends
 * are on one machine. Reading needs no socket: it is done on the status page and the rings.
 */
#ifndef BASE_ADMIN_PROTOCOL_H
#define BASE_ADMIN_PROTOCOL_H

#include <assert.h>
#include <stdint.h>

#include "limits.h"

#define ADMIN_MAGIC UINT32_C(0x31614445) /* "EDa1" */

enum admin_verb {
	ADMIN_PING = 1,
	ADMIN_SET = 2,       /* output channels to raw values: count, item[] */
	ADMIN_ONESHOT = 3,   /* slave_pos or ADMIN_ALL_SLAVES, dc_time_ns (absolute) or relative if
				is_relative */
	ADMIN_SDO_READ = 4,  /* slave_pos, index, subindex */
	ADMIN_SDO_WRITE = 5, /* slave_pos, index, subindex, data */
	ADMIN_STOP = 6,      /* orderly stop of the bus and the daemon */
	ADMIN_CLEAR = 7,     /* histograms and counters to zero */
};

/* Every slave with a one-shot output, all in one cycle or none. */
#define ADMIN_ALL_SLAVES UINT16_C(0xffff)

enum { ADMIN_ITEMS = 64, ADMIN_DATA_BYTES = 1024, ADMIN_TEXT_BYTES = 256 };

struct admin_item {
	char channel[LIMIT_NAME_BYTES];
	uint64_t raw;
};

struct admin_request {
	uint32_t magic;
	uint32_t verb; /* enum admin_verb */
	uint32_t count;
	uint16_t slave_pos;
	uint16_t index;
	uint8_t subindex;
	uint8_t is_relative;
	uint16_t data_len;
	uint32_t reserved;
	int64_t dc_time_ns;
	struct admin_item item[ADMIN_ITEMS];
	uint8_t data[ADMIN_DATA_BYTES];
};

struct admin_reply {
	uint32_t magic;
	int32_t result;     /* 0 or -errno */
	uint32_t sdo_abort; /* 0: none */
	uint32_t data_len;
	uint64_t cycle;              /* in which it took effect; SET, ONESHOT */
	int64_t dc_time_ns;          /* ONESHOT: the absolute time armed */
	char text[ADMIN_TEXT_BYTES]; /* one line: why it failed */
	uint8_t data[ADMIN_DATA_BYTES];
};

static_assert(sizeof(struct admin_request) == 32 + 64 * 72 + 1024, "both ends agree");
static_assert(sizeof(struct admin_reply) == 32 + 256 + 1024, "both ends agree");

#endif
