/* SPDX-License-Identifier: MIT */
#include "devices/cia402.h"

/* Statuswords of the states; voltage (bit 4) is always there. */
enum status {
	STATE_BITS = 0x006f,
	SWITCH_ON_DISABLED = 0x0040,
	READY_TO_SWITCH_ON = 0x0021,
	SWITCHED_ON = 0x0023,
	OPERATION_ENABLED = 0x0027,
	VOLTAGE = 0x0010,
};

enum control {
	SWITCH_ON = 0x01,
	ENABLE_VOLTAGE = 0x02,
	NO_QUICK_STOP = 0x04,
	ENABLE_OPERATION = 0x08,
	SHUTDOWN = ENABLE_VOLTAGE | NO_QUICK_STOP,
};

static uint16_t next(uint16_t state, uint16_t control)
{
	int has_power = (control & SHUTDOWN) == SHUTDOWN;
	int is_on = has_power && (control & SWITCH_ON);
	int is_enabled = is_on && (control & ENABLE_OPERATION);

	switch (state) {
	case SWITCH_ON_DISABLED:
		return has_power && !is_on ? READY_TO_SWITCH_ON : state;
	case READY_TO_SWITCH_ON:
		return !has_power ? SWITCH_ON_DISABLED : is_on ? SWITCHED_ON : state;
	case SWITCHED_ON:
	case OPERATION_ENABLED:
		return !has_power   ? SWITCH_ON_DISABLED
		       : !is_on     ? READY_TO_SWITCH_ON
		       : is_enabled ? OPERATION_ENABLED
				    : SWITCHED_ON;
	default: /* a word from the wire, or the first */
		return SWITCH_ON_DISABLED;
	}
}

uint16_t cia402_statusword(uint16_t status, uint16_t control)
{
	return (uint16_t)(next(status & STATE_BITS, control) | VOLTAGE);
}
