/* SPDX-License-Identifier: MIT */
/* Every option with the value that is in effect, and where that comes from. Context: blocking. */
#ifndef CONFIG_EFFECTIVE_H
#define CONFIG_EFFECTIVE_H

#include <stddef.h>

#include "base/config_change.h"
#include "config/config.h"

enum config_origin { CONFIG_ORIGIN_DEFAULT, CONFIG_ORIGIN_FILE, CONFIG_ORIGIN_SET };

struct config_item {
	const char *option; /* "cycle.period", "slaves[0].name", "slaves[0].sdo[1].index" */
	const char *value; /* as the file would have it; durations, sizes and per cents with unit */
	const char *unit;  /* of a plain number; "" */
	const char *default_value; /* NULL: the option is required */
	enum config_effect effect;
	enum config_origin origin;
	int line;     /* CONFIG_ORIGIN_FILE: of the file; else 0 */
	size_t place; /* of its row in the option table */
};

struct config_listener {
	void (*item)(void *ctx, const struct config_item *item);
	void *ctx;
};

/**
 * Read the configuration @source, whose callbacks are not used, and hand its options to @item: all
 * of the sections and of each item of the lists, in the order of the file. 0; the errors of
 * config_assemble(), -ENOMEM; @item is not called then.
 */
int config_effective(const struct config_source *source,
		     void (*item)(void *ctx, const struct config_item *item), void *ctx,
		     char *error, size_t error_bytes);

/** The same, and the configuration itself into @cfg; @cfg is untouched on failure. */
int config_effective_into(const struct config_source *source, struct config *cfg,
			  const struct config_listener *listener, char *error, size_t error_bytes);

/** "default", "file", "command line". */
const char *config_origin_to_str(enum config_origin origin);

#endif
