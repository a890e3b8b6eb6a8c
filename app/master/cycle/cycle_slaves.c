/* SPDX-License-Identifier: MIT */
/*
 * Which slaves are live: in OP, with real outputs and judged samples. The service thread names
 * those in OP; a frame that shows that a slave has left OP overrules it in the same cycle, so that
 * the next frame carries fail-safe values whatever the service thread is busy with.
 *
 * What a frame shows (bus.monitor): the AL status of all slaves ORed, and how many answered.
 *
 * - Expected are all slaves, in OP, without an error bit. If it is not so, somebody has left OP;
 *   the OR does not name him, so that no slave is live until the service thread has looked and
 *   named those that are.
 * - Those who are gone are known if the image is split (bus.datagrams: per_slave), all that answer
 *   are in OP, and the data is missing of just as many as did not answer, the reference clock not
 *   being one of them: the others stay live.
 * - One that is not ours on the wire: what the OR shows more in the frame in which it came is its
 *   own as long as that bit is seen, if the frame before it was not lost. INIT is accepted at any
 *   time while the process data is complete, which it would not be if one of ours were in INIT: the
 *   service thread leads it there. After a look that finds all of ours in OP, the rest of what
 *   the OR shows is not theirs.
 * - With a slave out of OP (per_slave), the OR shows its way back and nothing else: the service
 *   thread decides then, and always without bus.monitor.
 */
#include "base/slave_set.h"
#include "cycle/cycle_internal.h"
#include "wire/al.h"

enum { AL_SHOWN = AL_STATE_MASK | AL_ERROR };

static void alert(struct cycle *cy)
{
	cy->alerts++;
	atomic_store_explicit(&cy->alerts_shown, cy->alerts, memory_order_release);
}

uint64_t cycle_alerts(const struct cycle *cycle)
{
	return atomic_load_explicit(&cycle->alerts_shown, memory_order_acquire);
}

void cycle_update_live(struct cycle *cy)
{
	const struct cycle_named *named = cycle_named_take(cy);
	uint64_t in_op = cy->phase == CYCLE_OP ? UINT64_MAX : 0;

	/* A look that began before the newest alert does not know of it. */
	if (cy->has_gone && (!in_op || named->alerts == cy->alerts)) {
		cy->gone = slave_set_empty();
		cy->has_gone = 0;
		cy->strangers_al = in_op ? cy->al_status : cy->strangers_al;
	}
	cy->has_live = 0;
	for (unsigned w = 0; w < cy->set_words; w++) {
		uint64_t live = in_op & cy->all.word[w] & named->slaves.word[w] & ~cy->gone.word[w];

		check_restart_word(&cy->check, w, live & ~cy->live.word[w]);
		cy->live.word[w] = live;
		cy->has_live |= live != 0;
	}
}

const struct slave_set *cycle_outputs_live(const struct cycle *cy)
{
	static const struct slave_set none;

	return cy->is_latched_safe || cycle_is_unlocked_safe(cy) ? &none : &cy->live;
}

static int is_as_expected(const struct cycle *cy, const struct exchange_result *res)
{
	uint16_t expected = cy->spec.plan->slave_count;
	unsigned strangers = 0;

	if (res->al_wkc < expected) {
		return 0;
	}
	if (res->al_wkc > expected) {
		/* One of ours in INIT would be missing in the process data. */
		strangers = cy->strangers_al & ~(unsigned)AL_INIT;
		strangers |= res->status == EXCHANGE_OK ? AL_INIT : 0u;
	}
	return (cy->al_status & ~(strangers & ~(unsigned)AL_OP)) == AL_OP;
}

static int is_reference_in(const struct cycle *cy, const struct slave_set *set)
{
	for (unsigned i = slave_set_next(set, 0); i < cy->spec.slave_count;
	     i = slave_set_next(set, i + 1)) {
		if (cy->spec.slaves[i].is_dc_reference) {
			return 1;
		}
	}
	return 0;
}

/* The slaves that have left OP: all, unless the frame names them. */
static struct slave_set who_left(const struct cycle *cy, const struct exchange_result *res)
{
	const struct exchange_plan *plan = cy->spec.plan;

	if (plan->is_split && res->status == EXCHANGE_WKC_LOW && cy->al_status == AL_OP &&
	    res->al_wkc + slave_set_count(&res->slaves_low) == plan->slave_count &&
	    !is_reference_in(cy, &res->slaves_low)) {
		return res->slaves_low;
	}
	return cy->all;
}

/* State bits of those that have just joined: in the cycle before, all of ours were as expected. */
static uint16_t newcomers_al(const struct cycle *cy, const struct exchange_result *res)
{
	if (res->status != EXCHANGE_OK || res->al_wkc <= cy->slaves_found ||
	    cy->steps != cy->al_step + 1 || cy->slaves_found < cy->spec.plan->slave_count ||
	    !slave_set_is_equal(&cy->live, &cy->all)) {
		return 0;
	}
	return cy->al_status;
}

static void note_count(struct cycle *cy, const struct exchange_result *res)
{
	uint16_t expected = cy->spec.plan->slave_count;
	uint16_t found = res->al_wkc;

	SET(cy->spec.stats->slaves_found, found);
	if (found > expected) {
		ADD(cy->spec.stats->cycles_with_stranger, 1);
	}
	cy->strangers_al &= cy->al_status;
	if (found == cy->slaves_found) {
		return;
	}
	cy->strangers_al = newcomers_al(cy, res);
	cy->slaves_found = found;
	alert(cy);
	cycle_note(cy, EVENT_SLAVE_COUNT, (int64_t)cy->sample.cycle, found, expected);
}

void cycle_watch_slaves(struct cycle *cy, const struct exchange_result *res)
{
	struct slave_set left;

	if (!cy->spec.plan->monitor || res->status == EXCHANGE_NO_FRAME) {
		return;
	}
	cy->al_status = res->al_status & AL_SHOWN;
	SET(cy->spec.stats->al_status, cy->al_status);
	note_count(cy, res);
	cy->al_step = cy->steps;
	if (is_as_expected(cy, res) || !slave_set_is_equal(&cy->live, &cy->all)) {
		return;
	}
	left = who_left(cy, res);
	slave_set_or(&cy->gone, &left);
	cy->has_gone |= !slave_set_is_empty(&left);
	slave_set_and_not(&cy->live, &left);
	cy->has_live = !slave_set_is_empty(&cy->live);
	ADD(cy->spec.stats->op_lost, 1);
	alert(cy);
	cycle_note(cy, EVENT_OP_LOST, (int64_t)cy->sample.cycle, cy->al_status, res->al_wkc);
}
