/* SPDX-License-Identifier: MIT */
/* Expected against found slaves. Pure. */
#ifndef BUS_COMPARE_H
#define BUS_COMPARE_H

#include <stddef.h>

#include "base/sample.h"
#include "config/config.h"

/** 0; or -ENXIO and one line: position, what is expected, what was found. */
int compare_slaves(const struct config *cfg, const struct slave_info *found, size_t found_count,
		   char *error, size_t error_bytes);

#endif
