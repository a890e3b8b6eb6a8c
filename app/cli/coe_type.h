/* SPDX-License-Identifier: MIT */
/* Names of the data types of CoE objects, and PDO entries as JSON. */
#ifndef CLI_COE_TYPE_H
#define CLI_COE_TYPE_H

#include <stdint.h>

#include "cli/text.h"
#include "program/json.h"

/** Base data types of ETG.1020, "UINT"; "0x0800" for those of a device. Context: any. */
const char *coe_type_to_str(uint16_t type, char buf[TEXT_BYTES]);

/* An entry of a PDO, wherever it was read. */
struct coe_entry {
	uint16_t index; /* 0: padding */
	uint8_t subindex;
	uint16_t bits;
	uint16_t type; /* 0: not known */
	const char *name;
};

/** @entry as an object of the array that is open in @js. */
void coe_entry_json(struct json *js, const struct coe_entry *entry);

#endif
