/* SPDX-License-Identifier: MIT */
#include "cli/coe_type.h"

#include <stddef.h>
#include <stdio.h>

#include "wire/coe_type.h"

const char *coe_type_to_str(uint16_t type, char buf[TEXT_BYTES])
{
	const char *name = coe_type_name(type);

	if (name != NULL) {
		return name;
	}
	snprintf(buf, TEXT_BYTES, "0x%04x", type);
	return buf;
}
