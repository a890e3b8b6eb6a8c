/* SPDX-License-Identifier: MIT */
#include "config/output.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/limits.h"
#include "image/image.h"

static const char *const owner_names[] = {
	[CONFIG_OWNER_LOCAL] = "local",
	[CONFIG_OWNER_PROGRAM] = "program",
	[CONFIG_OWNER_REMOTE] = "remote",
};

static int is_item(const struct config_output *output, unsigned slave_pos, size_t item)
{
	return output->slave_pos == slave_pos && output->item == item;
}

const struct config_output *config_output_at(const struct config *cfg, unsigned slave_pos,
					     size_t item)
{
	/* Mostly there is one list, and its items are in their places. */
	if (item < cfg->output_count && is_item(&cfg->output[item], slave_pos, item)) {
		return &cfg->output[item];
	}
	for (size_t i = 0; i < cfg->output_count; i++) {
		if (is_item(&cfg->output[i], slave_pos, item)) {
			return &cfg->output[i];
		}
	}
	return NULL;
}

const struct config_output *config_output_find(const struct config *cfg, const char *channel)
{
	for (size_t i = 0; i < cfg->output_count; i++) {
		if (strncmp(cfg->output[i].channel, channel, LIMIT_NAME_BYTES) == 0) {
			return &cfg->output[i];
		}
	}
	return NULL;
}

const char *config_output_owner(const struct config_output *rules)
{
	return owner_names[rules == NULL ? CONFIG_OWNER_LOCAL : rules->owner];
}

unsigned config_output_index(const struct channel *channels, size_t index)
{
	unsigned outputs = 0;

	for (size_t i = 0; i < index; i++) {
		outputs += channels[i].direction == CHANNEL_OUTPUT;
	}
	return outputs;
}

int config_output_check(const struct config *cfg, const struct channel *ch, enum config_owner owner,
			uint64_t raw, char *reason, size_t reason_bytes)
{
	const struct config_output *rules = config_output_find(cfg, ch->name);
	double physical;

	if (ch->direction != CHANNEL_OUTPUT) {
		snprintf(reason, reason_bytes, "%s: is an input", ch->name);
		return -EPERM;
	}
	if ((rules == NULL ? CONFIG_OWNER_LOCAL : rules->owner) != owner) {
		snprintf(reason, reason_bytes, "%s: owned by %s, not %s (outputs[].owner)",
			 ch->name, config_output_owner(rules), owner_names[owner]);
		return -EPERM;
	}
	if (ch->bit_len < 64 && raw >> ch->bit_len != 0) {
		snprintf(reason, reason_bytes, "%s: %" PRIu64 " does not fit in %u bits", ch->name,
			 raw, ch->bit_len);
		return -ERANGE;
	}
	physical = image_raw_to_physical(ch, raw);
	if (isnan(physical)) {
		snprintf(reason, reason_bytes, "%s: is not a number", ch->name);
		return -ERANGE;
	}
	if (rules != NULL && (physical < rules->min || physical > rules->max)) {
		snprintf(reason, reason_bytes, "%s: %g is outside %g to %g (outputs[])", ch->name,
			 physical, rules->min, rules->max);
		return -ERANGE;
	}
	return 0;
}
