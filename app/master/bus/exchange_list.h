/* SPDX-License-Identifier: MIT */
/* The datagrams of the cyclic frames, listed for people. Context: service thread. */
#ifndef BUS_EXCHANGE_LIST_H
#define BUS_EXCHANGE_LIST_H

#include <stddef.h>
#include <stdint.h>

#include "bus/exchange_plan.h"

struct exchange;

enum { EXCHANGE_WKC_UNKNOWN = 0xffff };

struct exchange_datagram {
	uint8_t command; /* enum ecat_cmd */
	uint8_t frame;
	uint16_t bytes;
	uint32_t address;      /* logical, or the register << 16 and the station address */
	uint16_t wkc_expected; /* EXCHANGE_WKC_UNKNOWN: any */
	uint16_t wkc; /* in the newest frame that came back; EXCHANGE_WKC_UNKNOWN: there was none */
};

/**
 * Write the datagrams of @plan, in the order in which they are sent, to @ret, @capacity at most.
 * @ex executes @plan; NULL: nothing is being exchanged. Returns how many, or -E2BIG, -EINVAL the
 * plan does not fit into frames.
 */
int exchange_list(const struct exchange_plan *plan, const struct exchange *ex,
		  struct exchange_datagram *ret, size_t capacity);

#endif
