/* SPDX-License-Identifier: MIT */
#include "segment/fault.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/prng.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { FAULTS_MAX = 1024, LINE_BYTES = 256, SII_PRODUCT_BYTE = 0x14 };

struct fault_plan {
	struct prng prng;
	int64_t start_ns;
	uint64_t frames;
	size_t count;
	struct fault fault[FAULTS_MAX];
};

struct fault_plan *fault_plan_create(uint64_t seed, int64_t start_ns)
{
	struct fault_plan *plan = calloc(1, sizeof(*plan));

	if (plan != NULL) {
		plan->prng.state = seed;
		plan->start_ns = start_ns;
	}
	return plan;
}

void fault_plan_destroy(struct fault_plan *plan)
{
	free(plan);
}

void fault_plan_restart(struct fault_plan *plan, int64_t start_ns)
{
	plan->start_ns = start_ns;
}

/* A fault that cannot happen any more makes room for another. */
static struct fault *free_slot(struct fault_plan *plan)
{
	if (plan->count < FAULTS_MAX) {
		return &plan->fault[plan->count++];
	}
	for (size_t i = 0; i < plan->count; i++) {
		struct fault *f = &plan->fault[i];

		if (f->is_done || (f->trigger == FAULT_FRAME && f->frame < plan->frames)) {
			return f;
		}
	}
	return NULL;
}

int fault_plan_add(struct fault_plan *plan, const char *line, size_t slave_count, char *error,
		   size_t error_bytes)
{
	struct fault f;
	struct fault *slot;
	char copy[LINE_BYTES];
	int r;

	if (snprintf(copy, sizeof(copy), "%s", line) >= (int)sizeof(copy)) {
		snprintf(error, error_bytes, "line longer than %d characters", LINE_BYTES - 1);
		return -EINVAL;
	}
	r = fault_parse(copy, slave_count, &f, error, error_bytes);
	if (r <= 0) {
		return r;
	}
	slot = free_slot(plan);
	if (slot == NULL) {
		snprintf(error, error_bytes, "more than FAULTS_MAX = %d faults", FAULTS_MAX);
		return -EINVAL;
	}
	f.at_ns += plan->start_ns;
	*slot = f;
	return 0;
}

int fault_plan_load(struct fault_plan *plan, const char *path, size_t slave_count, char *error,
		    size_t error_bytes)
{
	FILE *file = fopen(path, "r");
	char line[LINE_BYTES + 2];
	char why[128];
	int number = 0;
	int r = 0;

	if (file == NULL) {
		r = -errno;
		snprintf(error, error_bytes, "%s: %s", path, strerror(-r));
		return r;
	}
	while (r == 0 && fgets(line, sizeof(line), file) != NULL) {
		number++;
		r = fault_plan_add(plan, line, slave_count, why, sizeof(why));
	}
	fclose(file);
	if (r < 0) {
		snprintf(error, error_bytes, "%s:%d: %s", path, number, why);
	}
	return r;
}

/* --- doing it --- */

static int is_due(struct fault_plan *plan, struct fault *f, int64_t t_ns)
{
	switch (f->trigger) {
	case FAULT_AT:
		if (f->is_done || t_ns < f->at_ns) {
			return 0;
		}
		if (f->for_ns > 0 && f->action <= FAULT_CORRUPT) {
			f->is_done = t_ns >= f->at_ns + f->for_ns;
			return !f->is_done;
		}
		f->is_done = 1;
		return 1;
	case FAULT_FRAME:
		return plan->frames == f->frame;
	case FAULT_EVERY:
		return plan->frames % f->frame == 0;
	case FAULT_PROBABLY:
		return prng_unit(&plan->prng) < f->probability;
	}
	return 0;
}

static void al_error(struct esc *esc, uint16_t code)
{
	uint8_t state = esc->reg[ESC_REG_AL_STATUS] & AL_STATE_MASK;

	/* The slave falls one state back, as on a synchronisation error. */
	esc_force_al_status(esc, (uint8_t)((state == AL_OP ? AL_SAFEOP : state) | AL_ERROR), code);
}

/* Another device sits there: as an EEPROM says it that is read from now on. */
static void change_identity(struct esc *esc, const struct fault *f)
{
	if (f->action == FAULT_SWITCH) {
		esc->identification = f->id;
	} else if (esc->sii_bytes >= SII_PRODUCT_BYTE + 4) {
		put_le32(esc->sii + SII_PRODUCT_BYTE, f->product);
	}
}

static void apply_to_frame(struct fault_plan *plan, const struct fault *f, struct segment *segment,
			   int64_t t_ns, size_t frame_len, struct fault_verdict *v)
{
	switch (f->action) {
	case FAULT_LOSE:
		v->is_lost = 1;
		break;
	case FAULT_DROP:
		v->is_dropped = 1;
		break;
	case FAULT_DELAY:
		v->delay_ns += f->by_ns;
		break;
	case FAULT_JITTER:
		v->transit_ns += (int64_t)prng_below(&plan->prng, (uint64_t)f->by_ns + 1);
		break;
	case FAULT_MIRROR:
		v->is_mirrored = 1;
		break;
	case FAULT_HOLD:
		v->is_held = 1;
		break;
	case FAULT_DOUBLE:
		v->is_doubled = 1;
		break;
	case FAULT_TRUNCATE:
		v->truncate_to = 1 + (size_t)prng_below(&plan->prng, frame_len - 1);
		break;
	case FAULT_DAMAGE:
		segment_damaged_frame(segment, t_ns, f->slave);
		v->is_dropped = 1;
		break;
	case FAULT_CORRUPT:
		v->corrupt_at = 14 + (size_t)prng_below(&plan->prng, frame_len - 14);
		v->corrupt_xor = (uint8_t)(1 + prng_below(&plan->prng, 255));
		break;
	case FAULT_CUT:
	case FAULT_HEAL:
	case FAULT_POWER_OFF:
	case FAULT_POWER_ON:
	case FAULT_RESET:
	case FAULT_DRIFT:
	case FAULT_AL_ERROR:
	case FAULT_PORT_ERROR:
	case FAULT_WATCHDOG:
	case FAULT_MAILBOX_STUCK:
	case FAULT_MAILBOX:
	case FAULT_IDENTITY:
	case FAULT_SYNC0_LOST:
	case FAULT_UNPLUG:
	case FAULT_PLUG:
	case FAULT_SLOW:
	case FAULT_REFUSE:
	case FAULT_OBEY:
	case FAULT_SWITCH:
		break;
	}
}

/* An earlier master may have given it any station address. */
static void plug(struct segment *segment, const struct fault *f, int64_t t_ns)
{
	struct esc *esc = segment_esc(segment, f->slave);

	if (f->address != 0) {
		put_le16(esc->reg + ESC_REG_STATION_ADDRESS, f->address);
	}
	segment_plug(segment, f->slave, t_ns);
}

static void change_obedience(struct esc *esc, const struct fault *f)
{
	if (f->action == FAULT_SLOW) {
		esc->al_fault.slow_state = f->state;
		esc->al_fault.slow_ns = f->by_ns;
	} else if (f->action == FAULT_REFUSE) {
		esc->al_fault.refused_state = f->state;
		esc->al_fault.refused_code = f->code;
	} else {
		esc->al_fault = (struct esc_al_fault){ 0 };
	}
}

static void misbehave(struct esc *esc, const struct fault *f)
{
	esc->mailbox_fault = (struct esc_mailbox_fault){ .kind = f->kind,
							 .count = f->count > 0 ? f->count : 1,
							 .by_ns = f->by_ns };
}

static void apply_to_slave(const struct fault *f, struct segment *segment, int64_t t_ns)
{
	struct esc *esc = segment_esc(segment, f->slave);

	switch (f->action) {
	case FAULT_CUT:
		segment_cut(segment, f->slave, t_ns);
		break;
	case FAULT_HEAL:
		segment_heal(segment, f->slave, t_ns);
		break;
	case FAULT_POWER_OFF:
		segment_power_off(segment, f->slave, t_ns);
		break;
	case FAULT_POWER_ON:
		segment_power_on(segment, f->slave, t_ns);
		break;
	case FAULT_RESET:
		segment_reset(segment, f->slave, t_ns);
		break;
	case FAULT_DRIFT:
		segment_drift(segment, f->slave, f->ppm, t_ns);
		break;
	case FAULT_AL_ERROR:
		al_error(esc, f->code);
		break;
	case FAULT_WATCHDOG:
		esc_force_watchdog(esc);
		break;
	case FAULT_MAILBOX_STUCK:
		esc->mailbox_stuck_until_ns = f->for_ns > 0 ? t_ns + f->for_ns : INT64_MAX;
		break;
	case FAULT_MAILBOX:
		misbehave(esc, f);
		break;
	case FAULT_IDENTITY:
	case FAULT_SWITCH:
		change_identity(esc, f);
		break;
	case FAULT_SYNC0_LOST:
		esc->sync.pulses_lost += f->count;
		break;
	case FAULT_PORT_ERROR:
		esc_count_error(esc, f->port, ESC_ERROR_RX);
		break;
	case FAULT_UNPLUG:
		segment_unplug(segment, f->slave, t_ns);
		break;
	case FAULT_PLUG:
		plug(segment, f, t_ns);
		break;
	case FAULT_SLOW:
	case FAULT_REFUSE:
	case FAULT_OBEY:
		change_obedience(esc, f);
		break;
	case FAULT_LOSE:
	case FAULT_DROP:
	case FAULT_DELAY:
	case FAULT_JITTER:
	case FAULT_MIRROR:
	case FAULT_HOLD:
	case FAULT_DOUBLE:
	case FAULT_TRUNCATE:
	case FAULT_DAMAGE:
	case FAULT_CORRUPT:
		break;
	}
}

struct fault_verdict fault_plan_judge(struct fault_plan *plan, struct segment *segment,
				      int64_t t_ns, size_t frame_len)
{
	struct fault_verdict v = { .is_dropped = 0 };

	plan->frames++;
	segment_advance(segment, t_ns);
	for (size_t i = 0; i < plan->count; i++) {
		if (is_due(plan, &plan->fault[i], t_ns)) {
			apply_to_frame(plan, &plan->fault[i], segment, t_ns, frame_len, &v);
			apply_to_slave(&plan->fault[i], segment, t_ns);
		}
	}
	return v;
}
