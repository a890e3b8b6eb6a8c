/* SPDX-License-Identifier: MIT */
/* Which bytes of the register file an ESC has, and which of them the master may write (data sheet).
 */
#include "segment/esc_internal.h"

#include <string.h>

enum { CONFIG_DC_UNITS = 0x0c }; /* 0x0141: SYNC out, latch in */

struct range {
	uint16_t first;
	uint16_t len;
};

/* What every ESC has. A register that does not exist gives no working counter. */
static const struct range always_readable[] = {
	{ ESC_REG_TYPE, 10 },
	{ ESC_REG_STATION_ADDRESS, 4 },
	{ ESC_REG_WRITE_ENABLE, 2 },
	{ ESC_REG_ESC_WRITE_ENABLE, 2 },
	{ ESC_REG_RESET_ECAT, 2 },
	{ ESC_REG_DL_CONTROL, 4 },
	{ 0x0108, 2 },
	{ ESC_REG_DL_STATUS, 2 },
	{ ESC_REG_AL_CONTROL, 2 },
	{ ESC_REG_AL_STATUS, 2 },
	{ ESC_REG_AL_STATUS_CODE, 2 },
	{ ESC_REG_PDI_CONTROL, 2 },
	{ ESC_REG_PDI_CONFIG, 4 },
	{ ESC_REG_ECAT_EVENT_MASK, 2 },
	{ ESC_REG_AL_EVENT_MASK, 4 },
	{ ESC_REG_ECAT_EVENT_REQUEST, 2 },
	{ ESC_REG_AL_EVENT_REQUEST, 4 },
	{ ESC_REG_RX_ERROR_COUNTER, 14 },
	{ ESC_REG_LOST_LINK_COUNTER, 4 },
	{ ESC_REG_WATCHDOG_DIVIDER, 2 },
	{ ESC_REG_WATCHDOG_TIME_PDI, 2 },
	{ ESC_REG_WATCHDOG_TIME_PD, 2 },
	{ ESC_REG_WATCHDOG_STATUS_PD, 4 },
	{ ESC_REG_EEPROM_CONFIG, 16 },
	{ ESC_REG_MII_CONTROL, 6 },
	{ ESC_REG_DIGITAL_OUTPUTS, 4 },
	{ ESC_REG_GENERAL_OUTPUTS, 16 },
	{ ESC_REG_USER_RAM, 128 },
};

static const struct range always_writable[] = {
	{ ESC_REG_STATION_ADDRESS, 2 },     { ESC_REG_WRITE_ENABLE, 2 },
	{ ESC_REG_ESC_WRITE_ENABLE, 2 },    { ESC_REG_RESET_ECAT, 1 },
	{ ESC_REG_DL_CONTROL, 4 },          { ESC_REG_AL_CONTROL, 2 },
	{ ESC_REG_ECAT_EVENT_MASK, 2 },     { ESC_REG_RX_ERROR_COUNTER, 14 },
	{ ESC_REG_LOST_LINK_COUNTER, 4 },   { ESC_REG_WATCHDOG_DIVIDER, 2 },
	{ ESC_REG_WATCHDOG_TIME_PDI, 2 },   { ESC_REG_WATCHDOG_TIME_PD, 2 },
	{ ESC_REG_WATCHDOG_COUNTER_PD, 2 }, { ESC_REG_EEPROM_CONFIG, 1 },
	{ ESC_REG_EEPROM_CONTROL, 14 },     { ESC_REG_MII_CONTROL, 6 },
	{ ESC_REG_DIGITAL_OUTPUTS, 4 },     { ESC_REG_GENERAL_OUTPUTS, 8 },
	{ ESC_REG_USER_RAM, 128 },
};

/* Times are 8 bytes; an ESC with 32 bits has the lower four. */
static const struct range system_time_readable[] = {
	{ ESC_REG_DC_SYSTEM_TIME, 8 },        { ESC_REG_DC_RECEIVE_TIME_PU, 8 },
	{ ESC_REG_DC_SYSTEM_TIME_OFFSET, 8 }, { ESC_REG_DC_SYSTEM_TIME_DELAY, 4 },
	{ ESC_REG_DC_SYSTEM_TIME_DIFF, 4 },   { ESC_REG_DC_SPEED_COUNTER_START, 6 },
};

static const struct range system_time_writable[] = {
	{ ESC_REG_DC_SYSTEM_TIME, 8 },       { ESC_REG_DC_SYSTEM_TIME_OFFSET, 8 },
	{ ESC_REG_DC_SYSTEM_TIME_DELAY, 4 }, { ESC_REG_DC_SPEED_COUNTER_START, 2 },
	{ ESC_REG_DC_TIME_FILTER, 2 },
};

static const struct range sync_readable[] = {
	{ ESC_REG_DC_CYCLIC_CONTROL, 5 }, { ESC_REG_DC_SYNC0_STATUS, 2 },
	{ ESC_REG_DC_START_TIME, 8 },     { ESC_REG_DC_NEXT_SYNC1, 8 },
	{ ESC_REG_DC_SYNC0_CYCLE, 8 },
};

static const struct range sync_writable[] = {
	{ ESC_REG_DC_CYCLIC_CONTROL, 2 },
	{ ESC_REG_DC_START_TIME, 8 },
	{ ESC_REG_DC_SYNC0_CYCLE, 8 },
};

/* Where a time has only its lower half. */
static const struct range upper_halves[] = {
	{ ESC_REG_DC_SYSTEM_TIME + 4, 4 },        { ESC_REG_DC_RECEIVE_TIME_PU + 4, 4 },
	{ ESC_REG_DC_SYSTEM_TIME_OFFSET + 4, 4 }, { ESC_REG_DC_START_TIME + 4, 4 },
	{ ESC_REG_DC_NEXT_SYNC1 + 4, 4 },
};

#define COUNT(a) (sizeof(a) / sizeof((a)[0]))

static void mark(uint8_t *map, const struct range *ranges, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		for (unsigned n = ranges[i].first; n < (unsigned)ranges[i].first + ranges[i].len;
		     n++) {
			map[n / 8] |= (uint8_t)(1u << (n % 8));
		}
	}
}

static void mark_units(struct esc *esc, uint16_t first, unsigned unit_bytes, unsigned count)
{
	for (unsigned n = 0; n < count; n++) {
		struct range all = { (uint16_t)(first + n * unit_bytes), (uint16_t)unit_bytes };

		mark(esc->readable, &all, 1);
		mark(esc->ecat_writable, &all, 1);
	}
}

static void unmark(uint8_t *map, const struct range *ranges, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		for (unsigned n = ranges[i].first; n < (unsigned)ranges[i].first + ranges[i].len;
		     n++) {
			map[n / 8] &= (uint8_t)~(1u << (n % 8));
		}
	}
}

static void mark_clock(struct esc *esc)
{
	static const struct range ports = { ESC_REG_DC_RECEIVE_TIME_PORT, 16 };
	static const struct range latch = { ESC_REG_DC_RECEIVE_TIME_PORT, 4 };
	const struct esc_features *f = &esc->features;
	int is_off = f->is_dc_by_eeprom && !(esc->reg[ESC_REG_ESC_CONFIG] & CONFIG_DC_UNITS);

	if (f->dc == ESC_DC_NONE) {
		return;
	}
	mark(esc->readable, &ports, 1);
	mark(esc->ecat_writable, &latch, 1);
	if (f->dc == ESC_DC_RECEIVE_TIMES || is_off) {
		return;
	}
	mark(esc->readable, system_time_readable, COUNT(system_time_readable));
	mark(esc->ecat_writable, system_time_writable, COUNT(system_time_writable));
	if (f->has_sync_unit) {
		mark(esc->readable, sync_readable, COUNT(sync_readable));
		mark(esc->ecat_writable, sync_writable, COUNT(sync_writable));
	}
	if (f->dc == ESC_DC_32) {
		unmark(esc->readable, upper_halves, COUNT(upper_halves));
		unmark(esc->ecat_writable, upper_halves, COUNT(upper_halves));
	}
}

void esc_register_layout(struct esc *esc)
{
	memset(esc->readable, 0, sizeof(esc->readable));
	memset(esc->ecat_writable, 0, sizeof(esc->ecat_writable));
	mark(esc->readable, always_readable, COUNT(always_readable));
	mark(esc->ecat_writable, always_writable, COUNT(always_writable));
	mark_units(esc, ESC_REG_FMMU, ESC_FMMU_BYTES, esc->features.fmmu_count);
	mark_units(esc, ESC_REG_SM, ESC_SM_BYTES, esc->features.sm_count);
	mark_clock(esc);
}
