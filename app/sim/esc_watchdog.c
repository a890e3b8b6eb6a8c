/* SPDX-License-Identifier: MIT */
/* The process data watchdog: started and fed by a SyncManager with the trigger bit, watched by the PDI. */
#include "sim/esc_inside.h"

static int64_t timeout_ns(const struct esc *esc)
{
	int64_t increment_ns = ((int64_t)get_le16(esc->reg + ESC_REG_WATCHDOG_DIVIDER) + 2) * 40;

	return increment_ns * get_le16(esc->reg + ESC_REG_WATCHDOG_TIME_PD);
}

void esc_watchdog_trigger(struct esc *esc, int64_t t_ns)
{
	int64_t ns = timeout_ns(esc);

	esc->watchdog_deadline_ns = ns > 0 ? t_ns + ns : INT64_MAX;
	esc->reg[ESC_REG_WATCHDOG_STATUS_PD] |= 1;
}

void esc_watchdog_stop(struct esc *esc)
{
	esc->watchdog_deadline_ns = INT64_MAX;
	esc->reg[ESC_REG_WATCHDOG_STATUS_PD] |= 1;
}

void esc_watchdog_expire(struct esc *esc)
{
	uint8_t *count = &esc->reg[ESC_REG_WATCHDOG_COUNTER_PD];

	esc->watchdog_deadline_ns = INT64_MAX;
	esc->reg[ESC_REG_WATCHDOG_STATUS_PD] &= (uint8_t)~1u;
	*count = (uint8_t)(*count < 0xff ? *count + 1 : 0xff);
	esc->al_event |= ESC_AL_EVENT_WATCHDOG;
}
