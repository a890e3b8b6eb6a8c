/* SPDX-License-Identifier: MIT */
/* The rules of outputs (outputs[] of the configuration): may a writer set this value? Context: any.
 */
#ifndef CONFIG_OUTPUT_H
#define CONFIG_OUTPUT_H

#include <stddef.h>
#include <stdint.h>

#include "base/sample.h"
#include "config/config.h"

/** Item @item of the list outputs[], or of slaves[@slave_pos].outputs[]; NULL. CONFIG_NO_SLAVE: of
 * outputs[]. */
const struct config_output *config_output_at(const struct config *cfg, unsigned slave_pos,
					     size_t item);

/** The rules of the output @channel. NULL: none configured, which means owner local and no limits.
 */
const struct config_output *config_output_find(const struct config *cfg, const char *channel);

/** "local", "program" or "remote"; @rules may be NULL. */
const char *config_output_owner(const struct config_output *rules);

/** The place of channel @index on the command board (base/board.h): outputs before it. */
unsigned config_output_index(const struct channel *channels, size_t index);

/**
 * May a writer of @owner set @ch to @raw? 0; -EPERM an input, or owned by another; -ERANGE too many
 * bits, or outside the configured limits; with the reason as one line in @reason.
 */
int config_output_check(const struct config *cfg, const struct channel *ch, enum config_owner owner,
			uint64_t raw, char *reason, size_t reason_bytes);

#endif
