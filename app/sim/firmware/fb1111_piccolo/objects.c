/* SPDX-License-Identifier: MIT */
#include "objects.h"

#include <string.h>

#include "pdo.h"

enum { SYNC_TYPE_DC_SYNC0 = 2, SYNC_TYPES_DC_SYNC0 = 0x0004, ENTRIES_SYNC = 0x20 };

/* Sorted by index and subindex; subindex 0 of a lone value is the value itself. */
const struct piccolo_object piccolo_objects[] = {
	{ 0x1000, 0, PICCOLO_UDINT, ACCESS_RO, VALUE_FIXED, PICCOLO_DEVICE_TYPE, "Device type" },
	{ 0x1008, 0, PICCOLO_STRING, ACCESS_RO, VALUE_NAME, 0, "Device name" },
	{ 0x1009, 0, PICCOLO_STRING, ACCESS_RO, VALUE_HARDWARE, 0, "Hardware version" },
	{ 0x100a, 0, PICCOLO_STRING, ACCESS_RO, VALUE_SOFTWARE, 0, "Software version" },

	{ 0x1018, 0, PICCOLO_USINT, ACCESS_RO, VALUE_FIXED, 4, "Identity" },
	{ 0x1018, 1, PICCOLO_UDINT, ACCESS_RO, VALUE_FIXED, PICCOLO_VENDOR_ID, "Vendor ID" },
	{ 0x1018, 2, PICCOLO_UDINT, ACCESS_RO, VALUE_FIXED, PICCOLO_PRODUCT_CODE, "Product code" },
	{ 0x1018, 3, PICCOLO_UDINT, ACCESS_RO, VALUE_FIXED, PICCOLO_REVISION, "Revision" },
	{ 0x1018, 4, PICCOLO_UDINT, ACCESS_RO, VALUE_FIXED, PICCOLO_SERIAL, "Serial number" },

	{ 0x1600, 0, PICCOLO_USINT, ACCESS_RO, VALUE_FIXED, PICCOLO_RX_ENTRIES, "RxPDO Outputs" },
	{ 0x1600, 1, PICCOLO_UDINT, ACCESS_RO, VALUE_RX_ENTRY, 0, "Mapped object 1" },
	{ 0x1600, 2, PICCOLO_UDINT, ACCESS_RO, VALUE_RX_ENTRY, 1, "Mapped object 2" },
	{ 0x1600, 3, PICCOLO_UDINT, ACCESS_RO, VALUE_RX_ENTRY, 2, "Mapped object 3" },

	{ 0x1a00, 0, PICCOLO_USINT, ACCESS_RO, VALUE_FIXED, PICCOLO_TX_ENTRIES, "TxPDO Inputs" },
	{ 0x1a00, 1, PICCOLO_UDINT, ACCESS_RO, VALUE_TX_ENTRY, 0, "Mapped object 1" },
	{ 0x1a00, 2, PICCOLO_UDINT, ACCESS_RO, VALUE_TX_ENTRY, 1, "Mapped object 2" },
	{ 0x1a00, 3, PICCOLO_UDINT, ACCESS_RO, VALUE_TX_ENTRY, 2, "Mapped object 3" },
	{ 0x1a00, 4, PICCOLO_UDINT, ACCESS_RO, VALUE_TX_ENTRY, 3, "Mapped object 4" },

	{ 0x1c00, 0, PICCOLO_USINT, ACCESS_RO, VALUE_FIXED, PICCOLO_SM_COUNT, "SyncManager types" },
	{ 0x1c00, 1, PICCOLO_USINT, ACCESS_RO, VALUE_SM_TYPE, 0, "SM0" },
	{ 0x1c00, 2, PICCOLO_USINT, ACCESS_RO, VALUE_SM_TYPE, 1, "SM1" },
	{ 0x1c00, 3, PICCOLO_USINT, ACCESS_RO, VALUE_SM_TYPE, 2, "SM2" },
	{ 0x1c00, 4, PICCOLO_USINT, ACCESS_RO, VALUE_SM_TYPE, 3, "SM3" },

	{ 0x1c12, 0, PICCOLO_USINT, ACCESS_RW_PREOP, VALUE_RX_ASSIGNED, 0, "RxPDO assign" },
	{ 0x1c12, 1, PICCOLO_UINT, ACCESS_RW_PREOP, VALUE_RX_PDO, 0, "RxPDO 1" },
	{ 0x1c13, 0, PICCOLO_USINT, ACCESS_RW_PREOP, VALUE_TX_ASSIGNED, 0, "TxPDO assign" },
	{ 0x1c13, 1, PICCOLO_UINT, ACCESS_RW_PREOP, VALUE_TX_PDO, 0, "TxPDO 1" },

	{ 0x1c32, 0x00, PICCOLO_USINT, ACCESS_RO, VALUE_FIXED, ENTRIES_SYNC,
	  "Output sync parameters" },
	{ 0x1c32, 0x01, PICCOLO_UINT, ACCESS_RW_PREOP, VALUE_SYNC_TYPE, 0, "Sync type" },
	{ 0x1c32, 0x02, PICCOLO_UDINT, ACCESS_RO, VALUE_CYCLE, 0, "Cycle time" },
	{ 0x1c32, 0x04, PICCOLO_UINT, ACCESS_RO, VALUE_FIXED, SYNC_TYPES_DC_SYNC0,
	  "Sync types supported" },
	{ 0x1c32, 0x05, PICCOLO_UDINT, ACCESS_RO, VALUE_FIXED, PICCOLO_MIN_CYCLE_NS,
	  "Minimum cycle time" },
	{ 0x1c32, 0x0c, PICCOLO_UINT, ACCESS_RO, VALUE_OVERRUNS, 0, "Cycle time too small" },
	{ 0x1c32, 0x20, PICCOLO_BOOL, ACCESS_RO, VALUE_FIXED, 0, "Sync error" },

	{ 0x1c33, 0x00, PICCOLO_USINT, ACCESS_RO, VALUE_FIXED, ENTRIES_SYNC,
	  "Input sync parameters" },
	{ 0x1c33, 0x01, PICCOLO_UINT, ACCESS_RW_PREOP, VALUE_SYNC_TYPE, 0, "Sync type" },
	{ 0x1c33, 0x02, PICCOLO_UDINT, ACCESS_RO, VALUE_CYCLE, 0, "Cycle time" },
	{ 0x1c33, 0x04, PICCOLO_UINT, ACCESS_RO, VALUE_FIXED, SYNC_TYPES_DC_SYNC0,
	  "Sync types supported" },
	{ 0x1c33, 0x05, PICCOLO_UDINT, ACCESS_RO, VALUE_FIXED, PICCOLO_MIN_CYCLE_NS,
	  "Minimum cycle time" },
	{ 0x1c33, 0x06, PICCOLO_UDINT, ACCESS_RO, VALUE_FIXED, PICCOLO_COPY_NS,
	  "Calc and copy time" },
	{ 0x1c33, 0x0c, PICCOLO_UINT, ACCESS_RO, VALUE_OVERRUNS, 0, "Cycle time too small" },
	{ 0x1c33, 0x20, PICCOLO_BOOL, ACCESS_RO, VALUE_FIXED, 0, "Sync error" },

	{ 0x6000, 0, PICCOLO_USINT, ACCESS_RO, VALUE_FIXED, 4, "Inputs" },
	{ 0x6000, 1, PICCOLO_UINT, ACCESS_RO, VALUE_ADC, 0, "adc" },
	{ 0x6000, 2, PICCOLO_UINT, ACCESS_RO, VALUE_COUNTER, 0, "counter" },
	{ 0x6000, 3, PICCOLO_ULINT, ACCESS_RO, VALUE_SAMPLE_TIME, 0, "sample_time" },
	{ 0x6000, 4, PICCOLO_USINT, ACCESS_RO, VALUE_STATUS, 0, "status" },

	{ 0x7000, 0, PICCOLO_USINT, ACCESS_RO, VALUE_FIXED, 2, "Outputs" },
	{ 0x7000, 1, PICCOLO_BOOL, ACCESS_RO, VALUE_LED, 0, "led" },
	{ 0x7000, 2, PICCOLO_ULINT, ACCESS_RO, VALUE_ONESHOT_TIME, 0, "oneshot_time" },

	{ 0x8000, 0, PICCOLO_USINT, ACCESS_RO, VALUE_FIXED, 2, "Settings" },
	{ 0x8000, 1, PICCOLO_USINT, ACCESS_RW_PREOP, VALUE_MODE, 0, "mode" },
	{ 0x8000, 2, PICCOLO_UINT, ACCESS_RW, VALUE_REFRESH, 0, "pdo_refresh_ms" },
};

const uint16_t piccolo_object_count = sizeof(piccolo_objects) / sizeof(piccolo_objects[0]);

void piccolo_settings_reset(struct piccolo *p)
{
	p->mode = PICCOLO_PERIODIC;
	p->refresh_ms = PICCOLO_REFRESH_DEFAULT_MS;
	p->rx_assigned = p->tx_assigned = 1;
}

uint32_t piccolo_object_find(uint16_t index, octet_t subindex,
			     const struct piccolo_object **ret_object)
{
	uint32_t abort = ABORT_NO_OBJECT;
	uint16_t i;

	for (i = 0; i < piccolo_object_count; i++) {
		if (piccolo_objects[i].index != index) {
			continue;
		}
		if (piccolo_objects[i].subindex == subindex) {
			*ret_object = &piccolo_objects[i];
			return ABORT_NONE;
		}
		abort = ABORT_NO_SUBINDEX;
	}
	return abort;
}

uint16_t piccolo_type_octets(enum piccolo_type type)
{
	switch (type) {
	case PICCOLO_BOOL:
	case PICCOLO_USINT:
		return 1;
	case PICCOLO_UINT:
		return 2;
	case PICCOLO_UDINT:
		return 4;
	case PICCOLO_ULINT:
		return 8;
	case PICCOLO_PADDING:
	case PICCOLO_STRING:
		return 0;
	}
	return 0;
}

/* A mapping entry as 0x1600 and 0x1A00 write it: index, subindex, bits. */
static uint32_t mapped(const struct piccolo_pdo *pdo, uint32_t i)
{
	const struct piccolo_entry *e = &pdo->entries[i];

	return (uint32_t)e->index << 16 | (uint32_t)e->subindex << 8 | e->bits;
}

static const char *text_of(const struct piccolo *p, enum piccolo_value value)
{
	if (value == VALUE_NAME) {
		return piccolo_description.name;
	}
	return value == VALUE_HARDWARE ? piccolo_description.hardware_version : p->version;
}

/* Inputs belong to the ISR; they are copied with interrupts off. */
static uint64_t input_value(struct piccolo *p, enum piccolo_value value)
{
	struct piccolo_inputs inputs;
	octet_t status;

	p->hal.interrupts_off(p->hal.ctx);
	inputs = p->inputs;
	status = piccolo_pdo_status(p);
	p->hal.interrupts_on(p->hal.ctx);
	if (value == VALUE_ADC) {
		return inputs.adc;
	}
	if (value == VALUE_COUNTER) {
		return inputs.counter;
	}
	return value == VALUE_SAMPLE_TIME ? inputs.sample_time_ns : status;
}

static uint64_t number_of(struct piccolo *p, const struct piccolo_object *object)
{
	switch (object->value) {
	case VALUE_FIXED:
		return object->number;
	case VALUE_RX_ENTRY:
		return mapped(&piccolo_description.rx, object->number);
	case VALUE_TX_ENTRY:
		return mapped(&piccolo_description.tx, object->number);
	case VALUE_SM_TYPE:
		return piccolo_description.sm[object->number].type;
	case VALUE_RX_ASSIGNED:
		return p->rx_assigned;
	case VALUE_TX_ASSIGNED:
		return p->tx_assigned;
	case VALUE_RX_PDO:
		return piccolo_description.rx.index;
	case VALUE_TX_PDO:
		return piccolo_description.tx.index;
	case VALUE_SYNC_TYPE:
		return SYNC_TYPE_DC_SYNC0;
	case VALUE_CYCLE:
		return p->mode == PICCOLO_PERIODIC ? p->sync0.cycle_ns : 0;
	case VALUE_OVERRUNS:
		return p->sync0.overruns;
	case VALUE_ADC:
	case VALUE_COUNTER:
	case VALUE_SAMPLE_TIME:
	case VALUE_STATUS:
		return input_value(p, object->value);
	case VALUE_LED:
		return p->outputs.led;
	case VALUE_ONESHOT_TIME:
		return p->outputs.oneshot_time_ns;
	case VALUE_MODE:
		return (uint64_t)p->mode;
	case VALUE_REFRESH:
		return p->refresh_ms;
	case VALUE_NAME:
	case VALUE_HARDWARE:
	case VALUE_SOFTWARE:
		break;
	}
	return 0;
}

uint16_t piccolo_object_read(struct piccolo *p, const struct piccolo_object *object, octet_t *data)
{
	uint16_t len = piccolo_type_octets(object->type);
	uint64_t value;
	uint16_t i;

	if (object->type == PICCOLO_STRING) {
		const char *text = text_of(p, object->value);

		len = (uint16_t)strlen(text);
		for (i = 0; i < len && i < OBJECT_OCTETS_MAX; i++) {
			data[i] = OCTET((unsigned char)text[i]);
		}
		return i;
	}
	value = number_of(p, object);
	for (i = 0; i < len; i++) {
		data[i] = OCTET(value >> (8u * i));
	}
	return len;
}

static uint32_t set_mode(struct piccolo *p, uint32_t value)
{
	if (value != PICCOLO_PERIODIC && value != PICCOLO_ONESHOT) {
		return ABORT_VALUE;
	}
	p->mode = (enum piccolo_mode)value;
	return ABORT_NONE;
}

static uint32_t set_refresh(struct piccolo *p, uint32_t value)
{
	if (value < 1 || value > PICCOLO_REFRESH_MAX_MS) {
		return ABORT_VALUE;
	}
	p->refresh_ms = (uint16_t)value;
	return ABORT_NONE;
}

/* The assignment is fixed: 0 while the master rewrites it, 1 again, and the one PDO there is. */
static uint32_t set_assigned(octet_t *assigned, uint32_t value)
{
	if (value > 1) {
		return ABORT_VALUE;
	}
	*assigned = OCTET(value);
	return ABORT_NONE;
}

static uint32_t set_number(struct piccolo *p, const struct piccolo_object *object, uint32_t value)
{
	if (object->value == VALUE_MODE) {
		return set_mode(p, value);
	}
	if (object->value == VALUE_REFRESH) {
		return set_refresh(p, value);
	}
	if (object->value == VALUE_RX_ASSIGNED) {
		return set_assigned(&p->rx_assigned, value);
	}
	if (object->value == VALUE_TX_ASSIGNED) {
		return set_assigned(&p->tx_assigned, value);
	}
	if (object->value == VALUE_SYNC_TYPE) {
		return value == SYNC_TYPE_DC_SYNC0 ? ABORT_NONE : ABORT_VALUE;
	}
	return value == number_of(p, object) ? ABORT_NONE : ABORT_NOT_MAPPABLE;
}

uint32_t piccolo_object_write(struct piccolo *p, const struct piccolo_object *object,
			      const octet_t *data, uint32_t len)
{
	uint32_t value = 0;
	uint32_t i;

	if (object->access == ACCESS_RO) {
		return ABORT_READ_ONLY;
	}
	if (len != piccolo_type_octets(object->type)) {
		return ABORT_LENGTH;
	}
	if (object->access == ACCESS_RW_PREOP && p->al.state != PICCOLO_PREOP) {
		return ABORT_STATE;
	}
	for (i = 0; i < len; i++) { /* what can be written is no longer than 4 octets */
		value |= (uint32_t)data[i] << (8u * i);
	}
	return set_number(p, object, value);
}
