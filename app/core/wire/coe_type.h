/* SPDX-License-Identifier: MIT */
/* Names of the base data types of CoE objects (ETG.1020), as ESI files use them. Context: any. */
#ifndef WIRE_COE_TYPE_H
#define WIRE_COE_TYPE_H

#include <stdint.h>

/** "UINT"; NULL for a type of a device, and for 0. */
const char *coe_type_name(uint16_t type);
/**
 * The type of that name: also of a string with its length, "STRING(8)", and under the names that
 * ESI files use besides (BIT, SWITCH, OCTET_STRING). 0: none of them.
 */
uint16_t coe_type_of_name(const char *name);

#endif
