/* SPDX-License-Identifier: MIT */
/* Expected against found slaves. Pure. */
#ifndef BUS_COMPARE_H
#define BUS_COMPARE_H

#include <stddef.h>
#include <stdint.h>

#include "base/sample.h"
#include "config/config.h"

/**
 * Bind the configured slaves to the found ones, in order; optional ones may be left out. @id: their
 * explicit device identification, NULL: not read. @ret_config, of @found_count: the configured
 * slave at each position, -1: none. 0, or -ENXIO: it is not possible; compare_slaves() says why.
 */
int compare_bind(const struct config *cfg, const struct slave_info *found, const uint16_t *id,
		 size_t found_count, int *ret_config);

/**
 * Make @bound the configuration by position: slaves[] as bound in @config, start-up SDOs with them.
 * What belongs to absent slaves, their outputs, too, is left out.
 */
void compare_apply(const struct config *cfg, const int *config, size_t found_count,
		   struct config *bound);

/** The rule of one slave: is @found, with explicit device identification @id, what @want states? */
int compare_is_wanted(const struct config_slave *want, const struct slave_info *found, unsigned id);
/** The part of it about the revision. */
int compare_is_revision_wanted(const struct config_slave *want, uint32_t revision);
/** 1 if it states more than a vendor: it can be recognised at another place. */
int compare_is_specific(const struct config_slave *want);

/** "vendor 0x00000002 product 0x04570862 revision any"; what else @want states. */
void compare_wanted_format(const struct config_slave *want, char *buf, size_t bytes);
/** The same of a device, with its name. */
void compare_found_format(const struct config_slave *want, const struct slave_info *found,
			  unsigned id, char *buf, size_t bytes);

/** 0; or -ENXIO and one line: position, what is expected, what was found. */
int compare_slaves(const struct config *cfg, const struct slave_info *found, const uint16_t *id,
		   size_t found_count, char *error, size_t error_bytes);

#endif
