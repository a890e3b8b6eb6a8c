/* SPDX-License-Identifier: MIT */
/* slaves[].channels[] on the channels of one slave: names, units, scales, types. Pure. */
#ifndef BUS_CHANNEL_RULES_H
#define BUS_CHANNEL_RULES_H

#include <stddef.h>

#include "base/sample.h"
#include "config/config.h"

/* The channels of one slave as the device names them, "SLAVE.NAME". */
struct channel_rules_of {
	const struct config *cfg; /* by position */
	const struct slave_info *slave;
	struct channel *channel;
	size_t count;
};

/**
 * Does @item mean @ch of @slave: by the name of the device, with or without the slave's, or by the
 * object ("0x6000:01")? @ch must not have been renamed.
 */
int channel_rule_matches(const struct config_channel *item, const struct slave_info *slave,
			 const struct channel *ch);

/**
 * Can all items of the slave be applied? 0; -EINVAL with one line in @error: an item that meets no
 * channel, or more than one that it shall rename, or a type that does not fit, or a name that is
 * too long or taken. Nothing is changed.
 */
int channel_rules_check(const struct channel_rules_of *of, char *error, size_t error_bytes);

/** Apply them, in their order. channel_rules_check() must have been 0. 0, or -ENOMEM. */
int channel_rules_apply(const struct channel_rules_of *of);

/** "adc, counter, status", for a message: names of the device without the slave's; "..." where
 * there is no room for more. */
void channel_rules_list(const struct channel_rules_of *of, char *buf, size_t bytes);

#endif
