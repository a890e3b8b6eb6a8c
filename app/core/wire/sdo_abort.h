/* SPDX-License-Identifier: MIT */
/* SDO abort codes in words (ETG.1000.6, table 41). */
#ifndef WIRE_SDO_ABORT_H
#define WIRE_SDO_ABORT_H

#include <stdint.h>

/** "unknown" for a code that the table does not have. */
const char *sdo_abort_to_str(uint32_t code);

#endif
