/* SPDX-License-Identifier: MIT */
/* Channels with a meaning of their own, found also under another name (slaves[].channels[].name).
 * Context: any. */
#ifndef IMAGE_ENTRY_H
#define IMAGE_ENTRY_H

#include "base/sample.h"

enum { PICCOLO_VENDOR = 0x00000002, PICCOLO_PRODUCT = 0x04570862 };

static inline int slave_is_piccolo(const struct slave_info *slave)
{
	return slave->vendor == PICCOLO_VENDOR && slave->product == PICCOLO_PRODUCT;
}

/**
 * Is @ch of @slave the entry @entry ("adc", "oneshot_time")? Those of an FB1111-Piccolo are known
 * by their object, all others by their name: what is behind the last dot.
 */
int channel_is_entry(const struct slave_info *slave, const struct channel *ch, const char *entry);

#endif
