/* SPDX-License-Identifier: MIT */
/* Answer of ADMIN_STARTUP (base/admin_protocol.h): the start-up SDOs of a slave in the order in
 * which ecdaqd writes them. Each is this head and its data, padded to a multiple of 4 bytes. */
#ifndef BASE_STARTUP_RECORD_H
#define BASE_STARTUP_RECORD_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

/* Where a start-up SDO is from. */
enum startup_origin { STARTUP_OF_MODE, STARTUP_OF_ESI, STARTUP_OF_PDOS, STARTUP_OF_CONFIG };

struct startup_record {
	uint32_t line; /* of the configuration; 0: none */
	uint16_t index;
	uint16_t len; /* bytes of data behind this */
	uint8_t subindex;
	uint8_t is_complete;
	uint8_t transition; /* enum config_transition */
	uint8_t origin;     /* enum startup_origin */
};

static_assert(sizeof(struct startup_record) == 12, "both ends agree");

/** Bytes of a record with @len bytes of data. */
static inline size_t startup_record_bytes(size_t len)
{
	return sizeof(struct startup_record) + (len + 3) / 4 * 4;
}

#endif
