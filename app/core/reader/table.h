/* SPDX-License-Identifier: MIT */
/*
 * What a sample ring says of itself, checked and copied: the slaves of the segment, their channels,
 * and which sample is good. Context: any; nothing here refers to shared memory.
 */
#ifndef READER_TABLE_H
#define READER_TABLE_H

#include <stddef.h>
#include <stdint.h>

#include "base/limits.h"
#include "base/sample.h"
#include "base/slave_set.h"

/* Everything in it is consistent: texts end in zero, slave n is at position n, every channel lies
 * in the image and belongs to a slave. */
struct channel_table {
	struct sample_meta meta;
	const struct slave_info *slaves;
	const struct channel *channels; /* in the order of the ring */
	const uint32_t *order;          /* indices of channels, slave by slave */
	uint32_t first[LIMIT_SLAVES];   /* place in order[] of the slave's first channel */
	uint32_t count[LIMIT_SLAVES];   /* number of the slave's channels */
};

/**
 * Check and copy the meta area of a sample ring. 0; -EPROTO: not consistent; -EPROTONOSUPPORT:
 * another SAMPLE_VERSION; -ENOMEM (ret untouched on failure). Free with channel_table_destroy().
 */
int channel_table_create(const void *meta, size_t meta_bytes, struct channel_table **ret_table);
void channel_table_destroy(struct channel_table *table);

/** The slave's n-th channel, n below count[slave]. */
const struct channel *channel_table_at(const struct channel_table *table, uint32_t slave,
				       uint32_t n);
/**
 * Index of the channel of @slave whose entry (channel_is_entry()) is @entry;
 * -ENOENT. @direction: enum channel_direction.
 */
int channel_table_find_entry(const struct channel_table *table, uint32_t slave, const char *entry,
			     enum channel_direction direction);

/**
 * 1 if the sample of the slave at @slave_pos is good: the slave was in OP, its inputs are of this
 * cycle, and its conversion counter advanced as it must. The master has decided that; no flag of
 * the sample overrules it (with bus.datagrams: per_slave a sample flagged SAMPLE_WKC_LOW is bad for
 * some slaves only).
 */
int sample_is_good(const struct sample_header *header, uint16_t slave_pos);
/** The slaves whose sample is not good; those that are not on the bus are not among them. */
const struct slave_set *sample_bad_slaves(const struct sample_header *header);

#endif
