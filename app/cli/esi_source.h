/* SPDX-License-Identifier: MIT */
/* The ESI files of ecdaqd's bus.esi_dir. Context: blocking. */
#ifndef CLI_ESI_SOURCE_H
#define CLI_ESI_SOURCE_H

#include <stdint.h>

#include "cli/cli.h"
#include "esi/device.h"

/** The description of a slave that is on the bus; NULL: none. The files are read once; what cannot
 * be read is not reported here: ecdaqd has done that. */
const struct esi_device *esi_source_find(struct cli *cli, uint32_t vendor, uint32_t product,
					 uint32_t revision);

#endif
