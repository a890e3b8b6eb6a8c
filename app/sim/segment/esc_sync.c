/* SPDX-License-Identifier: MIT */
/*
 * The SYNC unit: SYNC0 at system times start, start + cycle, ...; once if the cycle time is 0. A
 * start time in the past is waited for until the counter comes round: 4.3 s with 32 bits, never
 * with 64 (T10). SYNC1 follows a SYNC0 by 0x09a4, and not again before it has come. Start and cycle
 * times are taken over on activation.
 */
#include "segment/esc_internal.h"

enum sync_bits {
	ACTIVATE_CYCLIC = 0x01,
	ACTIVATE_SYNC0 = 0x02,
	ACTIVATE_SYNC1 = 0x04,
	STATUS_SYNC0_PENDING = 0x01, /* 0x0984 */
	STATUS_SYNC1_PENDING = 0x02,
	STATUS_START_NOT_NEAR = 0x04,
	EVENT_SYNC0 = 0x08, /* 0x0151: which of them are AL events */
	EVENT_SYNC1 = 0x80,
};

static int has(const struct esc *esc, uint8_t bits)
{
	return (esc->sync.activation & bits) == bits;
}

static uint64_t wrapped(const struct esc *esc, uint64_t system_ns)
{
	return esc->features.dc == ESC_DC_32 ? system_ns & UINT32_MAX : system_ns;
}

void esc_sync_replan(struct esc *esc, int64_t t_ns)
{
	struct esc_sync *s = &esc->sync;

	s->next_true_ns = s->is_running ? esc_clock_when(esc, t_ns, s->next_local_ns) : INT64_MAX;
	if (s->next1_true_ns != INT64_MAX) {
		s->next1_true_ns = esc_clock_when(esc, t_ns, s->next1_local_ns);
	}
}

/* The start time was within the coming half of the counter's range, as it must be (0x0984 bit 2).
 */
static uint8_t plausibility(const struct esc *esc, int64_t t_ns)
{
	uint64_t ahead = esc->sync.next_local_ns - esc_system_time(esc, t_ns);
	int is_near =
		esc->features.dc == ESC_DC_32 ? (uint32_t)ahead <= INT32_MAX : ahead <= INT64_MAX;

	return is_near ? 0 : STATUS_START_NOT_NEAR;
}

static void start(struct esc *esc, int64_t t_ns)
{
	struct esc_sync *s = &esc->sync;

	s->is_running = 1;
	s->is_pending = 1;
	s->is_sync0_high = 0;
	s->next_local_ns = wrapped(esc, get_le64(esc->reg + ESC_REG_DC_START_TIME));
	s->cycle_ns = get_le32(esc->reg + ESC_REG_DC_SYNC0_CYCLE);
	s->sync1_ns = get_le32(esc->reg + ESC_REG_DC_SYNC1_CYCLE);
	s->next1_true_ns = INT64_MAX;
	esc->reg[ESC_REG_DC_ACTIVATION_STATUS] = plausibility(esc, t_ns);
}

static void stop(struct esc *esc)
{
	struct esc_sync *s = &esc->sync;

	s->is_running = 0;
	s->is_pending = 0;
	s->is_sync0_high = 0;
	s->next1_true_ns = INT64_MAX;
	esc->al_event &= ~(uint32_t)(ESC_AL_EVENT_SYNC0 | ESC_AL_EVENT_SYNC1);
	esc->reg[ESC_REG_DC_ACTIVATION_STATUS] = 0;
}

void esc_sync_activate(struct esc *esc, int64_t t_ns)
{
	struct esc_sync *s = &esc->sync;
	int was_on = has(esc, ACTIVATE_CYCLIC | ACTIVATE_SYNC0);
	int is_on;

	s->activation = esc->reg[ESC_REG_DC_ACTIVATION];
	is_on = has(esc, ACTIVATE_CYCLIC | ACTIVATE_SYNC0);
	/* A shot that fired leaves the unit active: it must be switched off before it can fire
	 * again. */
	if (is_on && !was_on) {
		start(esc, t_ns);
	} else if (!is_on) {
		stop(esc);
	}
	esc_sync_replan(esc, t_ns);
}

void esc_sync_acknowledge(struct esc *esc, unsigned sync)
{
	if (sync == 0) {
		esc->sync.is_sync0_high = 0;
		esc->al_event &= ~(uint32_t)ESC_AL_EVENT_SYNC0;
	} else {
		esc->al_event &= ~(uint32_t)ESC_AL_EVENT_SYNC1;
	}
}

static void plan_sync1(struct esc *esc, int64_t t_ns, uint64_t system_ns)
{
	struct esc_sync *s = &esc->sync;

	if (has(esc, ACTIVATE_SYNC1) && s->next1_true_ns == INT64_MAX) {
		s->next1_local_ns = wrapped(esc, system_ns + s->sync1_ns);
		s->next1_true_ns = esc_clock_when(esc, t_ns, s->next1_local_ns);
	}
}

void esc_sync_edge(struct esc *esc)
{
	struct esc_sync *s = &esc->sync;
	int64_t t_ns = s->next_true_ns;
	uint64_t system_ns = s->next_local_ns;
	int was_high = s->is_sync0_high;
	int is_lost = s->pulses_lost > 0;

	s->edges++;
	s->pulses_lost -= (uint64_t)is_lost;
	s->is_pending = 0;
	/* Without a pulse length the pin stays up until the PDI reads 0x098e (acknowledge mode). */
	s->is_sync0_high = get_le16(esc->reg + ESC_REG_DC_PULSE_LENGTH) == 0;
	if ((esc->reg[ESC_REG_SYNC_LATCH_CONFIG] & EVENT_SYNC0) && !is_lost) {
		esc->al_event |= ESC_AL_EVENT_SYNC0;
	}
	plan_sync1(esc, t_ns, system_ns);
	s->is_running = s->cycle_ns != 0;
	s->next_local_ns = wrapped(esc, system_ns + s->cycle_ns);
	esc_sync_replan(esc, t_ns);
	if (esc->sink != NULL && !was_high && !is_lost) {
		esc->sink(esc->sink_ctx, t_ns, system_ns);
	}
}

void esc_sync1_edge(struct esc *esc)
{
	esc->sync.next1_true_ns = INT64_MAX;
	if (esc->reg[ESC_REG_SYNC_LATCH_CONFIG] & EVENT_SYNC1) {
		esc->al_event |= ESC_AL_EVENT_SYNC1;
	}
}

void esc_sync_to_registers(struct esc *esc)
{
	const struct esc_sync *s = &esc->sync;
	uint8_t *r = esc->reg;
	uint8_t pending = s->is_pending ? STATUS_SYNC0_PENDING : 0;

	if (s->is_pending && has(esc, ACTIVATE_SYNC1)) {
		pending |= STATUS_SYNC1_PENDING;
	}
	r[ESC_REG_DC_ACTIVATION_STATUS] =
		(uint8_t)((r[ESC_REG_DC_ACTIVATION_STATUS] & STATUS_START_NOT_NEAR) | pending);
	r[ESC_REG_DC_SYNC0_STATUS] = s->is_sync0_high;
	/* 0x0990 reads as the next SYNC0 while there is one; written, it is the start time. */
	if (s->is_running) {
		put_le64(r + ESC_REG_DC_START_TIME, s->next_local_ns);
	}
	put_le64(r + ESC_REG_DC_NEXT_SYNC1, s->next1_true_ns != INT64_MAX ? s->next1_local_ns : 0);
}
