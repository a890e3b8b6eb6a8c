/* SPDX-License-Identifier: MIT */
#include "base/config_change.h"

#include <stdio.h>

const char *config_effect_to_str(uint32_t effect)
{
	static const char *const texts[CONFIG_EFFECTS] = {
		[CONFIG_EFFECT_RESCAN] = "rescan",
		[CONFIG_EFFECT_NOW] = "at once",
		[CONFIG_EFFECT_RESTART] = "restart of ecdaqd",
		[CONFIG_EFFECT_RECORD] = "restart of ecdaq-record",
		[CONFIG_EFFECT_DDS] = "restart of ecdaq-dds",
		[CONFIG_EFFECT_SYNC0] = "restart of ecdaq-sync0",
		[CONFIG_EFFECT_WEB] = "restart of ecdaq-web",
		[CONFIG_EFFECT_STREAM] = "restart of ecdaq-stream",
		[CONFIG_EFFECT_UPLINK] = "restart of ecdaq-uplink",
	};

	return effect < CONFIG_EFFECTS ? texts[effect] : "?";
}

static const char *shown(const char *value)
{
	return value[0] != '\0' ? value : "\"\"";
}

int config_change_format(const struct config_change *change, char *buf, size_t buf_len)
{
	int is_now = change->effect == CONFIG_EFFECT_NOW;

	return snprintf(buf, buf_len, "%s: %s -> %s: %s%s", change->option,
			shown(change->old_value), shown(change->new_value),
			is_now ? "" : "needs a ",
			is_now ? "in effect" : config_effect_to_str(change->effect));
}
