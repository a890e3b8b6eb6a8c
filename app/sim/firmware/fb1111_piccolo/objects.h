/* SPDX-License-Identifier: MIT */
/* The object dictionary: one table, from which the SDO server answers and the ESI file is written.
 */
#ifndef FB1111_PICCOLO_OBJECTS_H
#define FB1111_PICCOLO_OBJECTS_H

#include "piccolo.h"

enum piccolo_access {
	ACCESS_RO,
	ACCESS_RW,      /* in every state with a mailbox */
	ACCESS_RW_PREOP /* written in PREOP only */
};

/* SDO abort codes (ETG.1000.6). */
#define ABORT_NONE UINT32_C(0)
#define ABORT_COMMAND UINT32_C(0x05040001)
#define ABORT_UNSUPPORTED_ACCESS UINT32_C(0x06010000)
#define ABORT_READ_ONLY UINT32_C(0x06010002)
#define ABORT_NO_OBJECT UINT32_C(0x06020000)
#define ABORT_NOT_MAPPABLE UINT32_C(0x06040041)
#define ABORT_LENGTH UINT32_C(0x06070010)
#define ABORT_NO_SUBINDEX UINT32_C(0x06090011)
#define ABORT_VALUE UINT32_C(0x06090030)
#define ABORT_STATE UINT32_C(0x08000022)

/* Where the value comes from; VALUE_FIXED takes the number in the table. */
enum piccolo_value {
	VALUE_FIXED,
	VALUE_NAME,
	VALUE_HARDWARE,
	VALUE_SOFTWARE,
	VALUE_RX_ENTRY, /* number: entry of the RxPDO */
	VALUE_TX_ENTRY,
	VALUE_SM_TYPE, /* number: SyncManager */
	VALUE_RX_ASSIGNED,
	VALUE_TX_ASSIGNED,
	VALUE_RX_PDO,
	VALUE_TX_PDO,
	VALUE_SYNC_TYPE,
	VALUE_CYCLE,
	VALUE_OVERRUNS,
	VALUE_ADC,
	VALUE_COUNTER,
	VALUE_SAMPLE_TIME,
	VALUE_STATUS,
	VALUE_LED,
	VALUE_ONESHOT_TIME,
	VALUE_MODE,
	VALUE_REFRESH
};

struct piccolo_object {
	uint16_t index;
	octet_t subindex;
	enum piccolo_type type;
	enum piccolo_access access;
	enum piccolo_value value;
	uint32_t number;
	const char *name; /* of the entry; of the object where subindex is 0 */
};

enum { OBJECT_OCTETS_MAX = 64 }; /* longest value, a string */

extern const struct piccolo_object piccolo_objects[];
extern const uint16_t piccolo_object_count;

/** What can be written, at its default; on power-on and on every way from INIT to PREOP. */
void piccolo_settings_reset(struct piccolo *p);
/** @ret_object on success; otherwise ABORT_NO_OBJECT or ABORT_NO_SUBINDEX. */
uint32_t piccolo_object_find(uint16_t index, octet_t subindex,
			     const struct piccolo_object **ret_object);
/** Octets of a number's type; 0 for a string. */
uint16_t piccolo_type_octets(enum piccolo_type type);
/** Value of @object into @data (OBJECT_OCTETS_MAX); returns its length. */
uint16_t piccolo_object_read(struct piccolo *p, const struct piccolo_object *object, octet_t *data);
/** Write @len octets; returns an abort code. */
uint32_t piccolo_object_write(struct piccolo *p, const struct piccolo_object *object,
			      const octet_t *data, uint32_t len);

#endif
