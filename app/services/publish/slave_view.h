/* SPDX-License-Identifier: MIT */
/*
 * The sample ring's meta, sorted by slave: which channels each one has, and which of them are
 * called adc, counter and sample_time. Checked: a channel outside the image is -EPROTO. Context:
 * any.
 */
#ifndef PUBLISH_SLAVE_VIEW_H
#define PUBLISH_SLAVE_VIEW_H

#include <stddef.h>

#include "base/limits.h"
#include "base/sample.h"

struct slave_view {
	const struct slave_info *info;
	uint32_t first; /* in order[] of the table */
	uint32_t count; /* channels of this slave */
	int32_t adc;    /* index into the channel table; -1: none of that name */
	int32_t counter;
	int32_t sample_time;
};

struct slave_table {
	const struct sample_meta *meta; /* in the ring's own memory */
	const struct slave_info *slaves;
	const struct channel *channels;
	struct slave_view view[LIMIT_SLAVES];
	uint32_t order[LIMIT_CHANNELS]; /* channel indices, slave by slave */
};

/** 0; -EPROTO if @meta is not a sample ring's of this version or does not hold together. */
int slave_table_read(struct slave_table *table, const void *meta, size_t meta_bytes);

/** Is the sample of @slave in the cycle of @h good: fresh, in OP, and its counter right? */
int slave_is_good(const struct sample_header *h, const struct slave_view *view);

#endif
