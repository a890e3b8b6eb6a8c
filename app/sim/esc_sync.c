/* SPDX-License-Identifier: MIT */
/*
 * The SYNC unit: SYNC0 at system times start, start + cycle, ...; once if the cycle time is 0. A start
 * time in the past is waited for until the counter comes round: 4.3 s with 32 bits, never with 64 (T10).
 */
#include "sim/esc_inside.h"

#include <math.h>

enum { ACTIVATE_CYCLIC = 0x01, ACTIVATE_SYNC0 = 0x02 };

static int is_behind(const struct esc *esc, uint64_t system_ns, uint64_t now_ns)
{
	if (esc->features.dc == ESC_DC_32) {
		return (int32_t)((uint32_t)system_ns - (uint32_t)now_ns) < 0;
	}
	return system_ns < now_ns;
}

void esc_sync_replan(struct esc *esc, int64_t t_ns)
{
	struct esc_sync *s = &esc->sync;
	uint64_t now_ns;
	uint64_t left;
	double speed;
	int64_t guess;

	s->next_true_ns = INT64_MAX;
	if (!s->is_running) {
		return;
	}
	now_ns = esc_system_time(esc, t_ns);
	if (esc->features.dc == ESC_DC_32) {
		left = (uint32_t)((uint32_t)s->next_local_ns - (uint32_t)now_ns);
	} else if (is_behind(esc, s->next_local_ns, now_ns)) {
		return;
	} else {
		left = s->next_local_ns - now_ns;
	}
	if (left > INT64_MAX / 4) {
		return;
	}
	speed = (1.0 + esc->clock.ppm * 1e-6) * (1.0 + esc->clock.correction);
	guess = t_ns + (int64_t)ceil((double)left / speed - (double)1e-9);
	/* The clock is in whole ns: step to the first instant at which it shows the time. */
	while (guess > t_ns && esc_system_time(esc, guess - 1) - now_ns >= left) {
		guess--;
	}
	while (esc_system_time(esc, guess) - now_ns < left) {
		guess++;
	}
	s->next_true_ns = guess;
}

static uint64_t start_time(const struct esc *esc)
{
	return esc->features.dc == ESC_DC_32
		       ? get_le32(esc->reg + ESC_REG_DC_START_TIME)
		       : get_le64(esc->reg + ESC_REG_DC_START_TIME);
}

static void show_next(struct esc *esc)
{
	put_le64(esc->reg + ESC_REG_DC_START_TIME, esc->sync.next_local_ns);
}

void esc_sync_activate(struct esc *esc, int64_t t_ns)
{
	struct esc_sync *s = &esc->sync;
	uint8_t activation = esc->reg[ESC_REG_DC_ACTIVATION];
	int is_on = (activation & (ACTIVATE_CYCLIC | ACTIVATE_SYNC0)) ==
		    (ACTIVATE_CYCLIC | ACTIVATE_SYNC0);

	if (is_on && !s->is_running) {
		s->is_running = 1;
		s->next_local_ns = start_time(esc);
		s->is_single = get_le32(esc->reg + ESC_REG_DC_SYNC0_CYCLE) == 0;
	} else if (!is_on) {
		s->is_running = 0;
		esc->al_event &= ~(uint32_t)ESC_AL_EVENT_SYNC0;
	}
	esc->reg[ESC_REG_DC_ACTIVATION_STATUS] = s->is_running ? 1 : 0;
	esc_sync_replan(esc, t_ns);
}

void esc_sync_edge(struct esc *esc)
{
	struct esc_sync *s = &esc->sync;
	int64_t t_ns = s->next_true_ns;
	uint64_t system_ns = s->next_local_ns;

	s->edges++;
	esc->al_event |= ESC_AL_EVENT_SYNC0;
	if (s->is_single) {
		s->is_running = 0;
		esc->reg[ESC_REG_DC_ACTIVATION_STATUS] = 0;
		s->next_true_ns = INT64_MAX;
	} else {
		/* Bit 0: the first pulse is pending (ET1100 data sheet, 0x0984). */
		esc->reg[ESC_REG_DC_ACTIVATION_STATUS] = 0;
		s->next_local_ns += get_le32(esc->reg + ESC_REG_DC_SYNC0_CYCLE);
		if (esc->features.dc == ESC_DC_32) {
			s->next_local_ns &= UINT32_MAX;
		}
		esc_sync_replan(esc, t_ns);
		show_next(esc);
	}
	if (esc->sink != NULL) {
		esc->sink(esc->sink_ctx, t_ns, system_ns);
	}
}
