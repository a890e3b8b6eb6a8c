/* SPDX-License-Identifier: MIT */
/*
 * The CoE dictionary that follows from an SII image, or from a struct sii made otherwise: identity,
 * SyncManager kinds, PDO assignment (writable in PRE-OP unless fixed), PDO mapping (fixed), and the
 * mapped objects themselves, which hold what was written last. A device adds constants, and texts
 * if it has SDO information.
 */
#ifndef SIM_DEVICES_COE_DICTIONARY_H
#define SIM_DEVICES_COE_DICTIONARY_H

#include <stddef.h>
#include <stdint.h>

#include "wire/sii.h"

enum { COE_VALUE_BYTES = 64, COE_ASSIGNED_MAX = 80, COE_ASSIGN_FIRST = 0x1c10 };

/* ETG.1000.6, SDO abort codes. */
enum coe_abort {
	COE_OK = 0,
	COE_ABORT_TOGGLE = 0x05030000,
	COE_ABORT_COMMAND = 0x05040001,
	COE_ABORT_ACCESS = 0x06010000,
	COE_ABORT_READ_ONLY = 0x06010002,
	COE_ABORT_COUNT_NOT_ZERO = 0x06010003,
	COE_ABORT_NO_OBJECT = 0x06020000,
	COE_ABORT_NOT_MAPPABLE = 0x06040041,
	COE_ABORT_TOO_MANY = 0x06040042,
	COE_ABORT_LENGTH = 0x06070010,
	COE_ABORT_NO_SUBINDEX = 0x06090011,
	COE_ABORT_GENERAL = 0x08000000,
	COE_ABORT_STATE = 0x08000022,
};

struct coe_value {
	uint8_t bytes[COE_VALUE_BYTES];
	size_t len;
};

struct coe_assignment {
	uint8_t count;
	uint16_t pdo[COE_ASSIGNED_MAX];
};

/* Something to read that no SII says. */
struct coe_constant {
	uint16_t index;
	uint8_t subindex;
	uint8_t bytes;
	uint32_t value;
};

struct coe_dictionary {
	const struct sii *sii; /* not taken over */
	char name[SII_NAME_BYTES];
	/* What a device adds after init; not taken over. */
	const struct coe_constant *constant;
	size_t constant_count;
	const char *const *text; /* of entries, by their name number - 1; NULL: no SDO information
				  */
	size_t text_count;
	const uint32_t *unit; /* of entries, by their number in sii; NULL: none has one */
	uint32_t device_type; /* object 0x1000; after init: a modular device */
	uint8_t is_fixed;     /* assignments can never be written */
	struct coe_assignment assignment[SII_LIMIT_SM];
	uint64_t entry_value[SII_LIMIT_ENTRIES];
	uint8_t is_preop; /* assignments can be written */
};

void coe_dictionary_init(struct coe_dictionary *d, const struct sii *sii, const char *name);
/** Default assignments, values 0. */
void coe_dictionary_reset(struct coe_dictionary *d);

/** Value of @index:@subindex. COE_OK or the abort code; @ret untouched then. */
enum coe_abort coe_dictionary_read(const struct coe_dictionary *d, uint16_t index, uint8_t subindex,
				   struct coe_value *ret);
enum coe_abort coe_dictionary_write(struct coe_dictionary *d, uint16_t index, uint8_t subindex,
				    const uint8_t *bytes, size_t len);

/* What SDO information says of one entry. */
struct coe_entry_info {
	uint16_t data_type; /* ETG.1020 base data type */
	uint16_t bit_len;
	const char *text; /* "" where there is none */
	uint32_t unit;    /* wire/coe_unit.h; 0: none */
};

/** COE_OK or the abort code; @ret untouched then. */
enum coe_abort coe_dictionary_entry_info(const struct coe_dictionary *d, uint16_t index,
					 uint8_t subindex, struct coe_entry_info *ret);
/** The first index above @after, or 0: no more. From 0 on, all there are. */
uint16_t coe_dictionary_next(const struct coe_dictionary *d, uint16_t after);

/** Bits that are assigned to SyncManager @sm now. */
uint32_t coe_dictionary_sm_bits(const struct coe_dictionary *d, size_t sm);
/** 1: a PDO is assigned to SyncManager @sm more than once, so that its objects are mapped twice. */
int coe_dictionary_sm_has_twice(const struct coe_dictionary *d, size_t sm);

#endif
