/* SPDX-License-Identifier: MIT */
/* From the command line of ecdaq-sim to its segment: names, EEPROM images, crystals. */
#ifndef SIM_SIMULATOR_TOPOLOGY_H
#define SIM_SIMULATOR_TOPOLOGY_H

#include "segment/segment.h"
#include "simulator/options.h"

/**
 * Make the segment that @opt asks for, with power since @t_ns. 0, or -1 with one line on stderr. An
 * image that is damaged behind its identity is reported, and simulated as it is.
 */
int topology_create(const struct sim_options *opt, int64_t t_ns, struct segment **ret_segment);

#endif
