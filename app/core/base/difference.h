/* SPDX-License-Identifier: MIT */
/* Answer of ADMIN_COMPARE (base/admin_protocol.h): an array of these, in the order of slaves[],
 * then of the positions, then of slaves[].channels[], slaves[].pdos[] and outputs[]. */
#ifndef BASE_DIFFERENCE_H
#define BASE_DIFFERENCE_H

#include <assert.h>
#include <stdint.h>

#include "base/limits.h"

enum difference_kind {
	DIFFERENCE_MISSING = 1,    /* a configured slave is not there */
	DIFFERENCE_OPTIONAL = 2,   /* the same, and it may be absent */
	DIFFERENCE_UNEXPECTED = 3, /* a device is not configured */
	DIFFERENCE_IDENTITY = 4,   /* another device, or another property of the right one */
	DIFFERENCE_PLACE = 5,      /* a configured slave is at another position */
	DIFFERENCE_LOST = 6,       /* it was found, and does not answer any more */
	DIFFERENCE_CHANNEL = 7,    /* an output is configured that does not exist */
	DIFFERENCE_UNCHECKED = 8,  /* outputs or PDOs cannot be compared: why, in found */
	DIFFERENCE_NO_CHANNEL = 9, /* an item of slaves[].channels[] that meets no channel */
	DIFFERENCE_PDOS = 10,      /* slaves[].pdos[] is not what is assigned */
};

#define DIFFERENCE_NOWHERE UINT16_C(0xffff)

struct difference {
	uint16_t kind;     /* enum difference_kind */
	uint16_t item;     /* of slaves[] or outputs[]; DIFFERENCE_NOWHERE */
	uint16_t position; /* on the bus; DIFFERENCE_NOWHERE */
	uint16_t reserved;
	uint32_t line;               /* of the configuration file; 0: none */
	char name[LIMIT_NAME_BYTES]; /* of the slave or channel; "": it has none */
	char property[16];           /* DIFFERENCE_IDENTITY: "device", "revision" ... */
	char group[32];              /* of the slave; "": none */
	char expected[100];
	char found[120];
};

static_assert(sizeof(struct difference) == 344, "both ends agree");

/** 1: of a kind that is only for information. */
static inline int difference_is_note(const struct difference *diff)
{
	return diff->kind == DIFFERENCE_OPTIONAL || diff->kind == DIFFERENCE_UNCHECKED;
}

#endif
