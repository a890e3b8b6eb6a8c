/* SPDX-License-Identifier: MIT */
/* Names of the data types of CoE objects. */
#ifndef CLI_COE_TYPE_H
#define CLI_COE_TYPE_H

#include <stdint.h>

#include "cli/text.h"

/** Base data types of ETG.1020, "UINT"; "0x0800" for those of a device. Context: any. */
const char *coe_type_to_str(uint16_t type, char buf[TEXT_BYTES]);

#endif
