/* SPDX-License-Identifier: MIT */
/* Names for slaves and channels out of whatever a slave calls itself. Pure. */
#ifndef BUS_NAMES_H
#define BUS_NAMES_H

#include <stddef.h>

#include "base/sample.h"
#include "bus/pdo.h"

/** Lower case, runs of anything but letters and digits become one underscore; never starts or ends
 * with one. */
void name_sanitise(const char *text, char *ret_name, size_t name_bytes);

/** "piccolo0", "el2828_1": the last word of a name like "FB1111-Piccolo", else the first, and the
 * position. */
void name_slave(const char *device, int is_piccolo, size_t pos, char *ret_name, size_t name_bytes);

/**
 * Names of @count entries of one slave, without the slave's name: the entry's own; where several
 * share it, the PDO's in front; where that is not enough, index and subindex behind; at last a
 * number. Each has less than @name_bytes (16 to PDO_NAME_BYTES) bytes.
 */
void name_entries(const struct pdo_entry *entry, size_t count, size_t name_bytes,
		  char (*ret_name)[PDO_NAME_BYTES]);

#endif
