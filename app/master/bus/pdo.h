/* SPDX-License-Identifier: MIT */
/* One mapped entry of a PDO, read from CoE or SII. */
#ifndef BUS_PDO_H
#define BUS_PDO_H

#include <stdint.h>

#include "base/limits.h"

enum { PDO_LIMIT = LIMIT_CHANNELS, PDO_NAME_BYTES = LIMIT_NAME_BYTES };

struct pdo_entry {
	uint16_t pdo;   /* 0x1600, 0x1A00 */
	uint16_t index; /* 0: padding */
	uint8_t subindex;
	uint8_t sm; /* SyncManager */
	uint8_t bit_len;
	uint8_t is_output;           /* from the master's side */
	uint16_t data_type;          /* CoE number, 0: not given */
	char unit[LIMIT_UNIT_BYTES]; /* "": not given */
	char name[PDO_NAME_BYTES];
	char pdo_name[PDO_NAME_BYTES];
};

#endif
