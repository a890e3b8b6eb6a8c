/* SPDX-License-Identifier: MIT */
/*
 * The error counters of a slave's chip, 0x0300 to 0x0313, as sums (T28). A counter is 8 bits wide
 * and stops at 255 (ET1100 data sheet, registers 0x0300 to 0x0313), so it is cleared by a write
 * before it saturates, and the sum of its increments is shown. What a slave counted before the
 * first read is in the sum, too.
 */
#ifndef BUS_ERROR_COUNTERS_H
#define BUS_ERROR_COUNTERS_H

#include <stdint.h>

#include "base/status.h"
#include "wire/esc_reg.h"

enum {
	ERROR_PORT_BYTES = 14,           /* 0x0300: 8 receive, 4 forwarded, processing, PDI */
	ERROR_LINK_BYTES = ESC_PORTS,    /* 0x0310 */
	ERROR_CLEAR_AT = 0x80,           /* half way */
	ERROR_FORWARDED = 2 * ESC_PORTS, /* offset in the first group */
	ERROR_PROCESSING = 3 * ESC_PORTS,
	ERROR_PDI,
	ERROR_LINKS = ERROR_PORT_BYTES, /* the second group, behind it */
	ERROR_COUNTERS = ERROR_PORT_BYTES + ERROR_LINK_BYTES,
};

struct error_counters {
	uint8_t seen[ERROR_COUNTERS]; /* in the chip, at the last look */
	uint32_t sum[ERROR_COUNTERS];
	int is_short; /* a counter was saturated at 255: its sum is too low */
};

/**
 * Counters @first to @first + @count - 1 read @raw now. A counter that went down was cleared or
 * lost its power in between. Returns 1 if one of them should be cleared.
 */
int error_counters_take(struct error_counters *ec, unsigned first, const uint8_t *raw,
			unsigned count);
/** The chip's counters start at zero again: it was without power. The sums stay. */
void error_counters_restart(struct error_counters *ec);
/** The sums, into the slave's part of the status page. */
void error_counters_show(const struct error_counters *ec, struct slave_status *page);

#endif
