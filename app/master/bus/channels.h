/* SPDX-License-Identifier: MIT */
/* From the mapped entries of one slave to channels of the process image. Pure. */
#ifndef BUS_CHANNELS_H
#define BUS_CHANNELS_H

#include <stddef.h>

#include "base/sample.h"
#include "bus/pdo.h"
#include "bus/plan.h"

enum { CHANNELS_SM = 8 };

/* Where the bits of each SyncManager of the slave begin in the process image. */
struct channels_place {
	uint32_t bit_offset[CHANNELS_SM];
};

/* The channel table while it grows. */
struct channels_table {
	struct channel *channel;
	size_t count;
	size_t capacity;
};

/**
 * Append the channels of @slave to @table; sets its counter_channel and bits. 0, -ENOMEM or -E2BIG
 * (the count is untouched then).
 */
int channels_add(struct slave_info *slave, const struct pdo_entry *entry, size_t entry_count,
		 const struct channels_place *place, struct channels_table *table);

/** How many channels the slave has in a table that channels_add() made; they are together, from
 * @ret_first on. */
size_t channels_of(const struct channel *channel, size_t count, uint16_t slave_pos,
		   size_t *ret_first);

#endif
