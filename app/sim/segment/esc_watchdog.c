/* SPDX-License-Identifier: MIT */
/*
 * Two watchdogs. Process data: started and fed by a SyncManager with the trigger bit, which the
 * master writes. PDI: fed by every access of the application; a chip without a microcontroller
 * at its PDI has none.
 */
#include "segment/esc_internal.h"

enum { PDI_SPI = 0x05, PDI_FIRST_BUS = 0x08 };

static int64_t timeout_ns(const struct esc *esc, unsigned reg)
{
	int64_t increment_ns = ((int64_t)get_le16(esc->reg + ESC_REG_WATCHDOG_DIVIDER) + 2) * 40;

	return increment_ns * get_le16(esc->reg + reg);
}

static void count(struct esc *esc, unsigned reg)
{
	esc->reg[reg] = (uint8_t)(esc->reg[reg] < 0xff ? esc->reg[reg] + 1 : 0xff);
}

void esc_watchdog_trigger(struct esc *esc, int64_t t_ns)
{
	int64_t ns = timeout_ns(esc, ESC_REG_WATCHDOG_TIME_PD);

	esc->watchdog_deadline_ns = ns > 0 ? t_ns + ns : INT64_MAX;
	esc->reg[ESC_REG_WATCHDOG_STATUS_PD] |= 1;
}

void esc_watchdog_stop(struct esc *esc)
{
	esc->watchdog_deadline_ns = INT64_MAX;
}

void esc_watchdog_expire(struct esc *esc)
{
	esc->watchdog_deadline_ns = INT64_MAX;
	esc->reg[ESC_REG_WATCHDOG_STATUS_PD] &= (uint8_t)~1u;
	count(esc, ESC_REG_WATCHDOG_COUNTER_PD);
	esc->al_event |= ESC_AL_EVENT_WATCHDOG;
}

void esc_force_watchdog(struct esc *esc)
{
	esc_watchdog_expire(esc);
}

static int has_microcontroller(const struct esc *esc)
{
	uint8_t pdi = esc->reg[ESC_REG_PDI_CONTROL];

	return pdi == PDI_SPI || pdi >= PDI_FIRST_BUS;
}

void esc_pdi_watchdog_trigger(struct esc *esc, int64_t t_ns)
{
	int64_t ns = timeout_ns(esc, ESC_REG_WATCHDOG_TIME_PDI);

	if (has_microcontroller(esc)) {
		esc->pdi_watchdog_deadline_ns = ns > 0 ? t_ns + ns : INT64_MAX;
		esc->is_pdi_expired = 0;
	}
}

void esc_pdi_watchdog_expire(struct esc *esc)
{
	esc->pdi_watchdog_deadline_ns = INT64_MAX;
	esc->is_pdi_expired = 1;
	count(esc, ESC_REG_WATCHDOG_COUNTER_PDI);
}

int esc_pdi_watchdog_is_running(const struct esc *esc)
{
	/* Captures: 0 in an EK1100 (no PDI), 1 in digital terminals and behind microcontrollers. */
	return esc->is_eeprom_loaded && esc->reg[ESC_REG_PDI_CONTROL] != 0 && !esc->is_pdi_expired;
}
