/* SPDX-License-Identifier: MIT */
#include "cycle/cycle_internal.h"

#include <errno.h>

static void watch_wkc(struct cycle *cy, const struct exchange_result *res)
{
	if (res->status == EXCHANGE_WKC_LOW && cy->phase == CYCLE_OP) {
		ADD(cy->spec.stats->wkc_low, 1);
		cy->sample.flags |= SAMPLE_WKC_LOW;
		if (cy->wkc_low_in_row++ == 0) {
			cycle_note(cy, EVENT_WKC_LOW, (int64_t)cy->sample.cycle, res->wkc,
				   res->wkc_expected);
		}
	} else if (res->status == EXCHANGE_OK && cy->wkc_low_in_row > 0) {
		cycle_note(cy, EVENT_WKC_OK, (int64_t)cy->sample.cycle, res->wkc,
			   cy->wkc_low_in_row);
		cy->wkc_low_in_row = 0;
	}
}

void cycle_count_frames(struct cycle *cy, const struct exchange_result *res)
{
	struct cycle_stats *st = cy->spec.stats;

	ADD(st->cycles, 1);
	ADD(st->frames_sent, exchange_frame_count(cy->spec.plan));
	if (res->status == EXCHANGE_NO_FRAME) {
		ADD(st->frames_lost, 1);
		cy->sample.flags |= SAMPLE_LOST;
		cy->lost_in_row++;
		/* Of a long row the first and then each power of two is enough. */
		if ((cy->lost_in_row & (cy->lost_in_row - 1)) == 0) {
			cycle_note(cy, EVENT_FRAME_LOST, (int64_t)cy->sample.cycle, cy->lost_in_row,
				   0);
		}
	} else {
		cy->lost_in_row = 0;
		histogram_add(&st->round_trip, res->round_trip.ns);
	}
	if (res->late > 0) {
		ADD(st->frames_late, res->late);
		cy->sample.flags |= SAMPLE_LATE;
		cycle_note(cy, EVENT_FRAME_LATE, (int64_t)cy->sample.cycle, res->late_by, 0);
	}
	if (res->doubled > 0) {
		ADD(st->frames_doubled, res->doubled);
		cy->sample.flags |= SAMPLE_DOUBLED;
		cycle_note(cy, EVENT_FRAME_DOUBLED, (int64_t)cy->sample.cycle, 0, 0);
	}
	ADD(st->frames_foreign, res->foreign);
	watch_wkc(cy, res);
}

static void publish_dc(struct cycle *cy, int64_t dc_ns, int64_t mono_ns)
{
	uint64_t s = atomic_load_explicit(&cy->dc_sequence, memory_order_relaxed);

	atomic_store_explicit(&cy->dc_sequence, s + 1, memory_order_relaxed);
	atomic_thread_fence(memory_order_release);
	SET(cy->dc_ns, dc_ns);
	SET(cy->dc_mono_ns, mono_ns);
	atomic_store_explicit(&cy->dc_sequence, s + 2, memory_order_release);
}

int cycle_dc_now(const struct cycle *cycle, int64_t *ret_dc_ns)
{
	const struct platform *pf = &cycle->spec.platform;

	for (int tries = 0; tries < 1000; tries++) {
		uint64_t s = atomic_load_explicit(&cycle->dc_sequence, memory_order_acquire);
		int64_t dc_ns = atomic_load_explicit(&cycle->dc_ns, memory_order_relaxed);
		int64_t mono_ns = atomic_load_explicit(&cycle->dc_mono_ns, memory_order_relaxed);

		atomic_thread_fence(memory_order_acquire);
		if (s % 2 == 0 &&
		    atomic_load_explicit(&cycle->dc_sequence, memory_order_relaxed) == s) {
			if (s == 0) {
				return -EAGAIN;
			}
			*ret_dc_ns = dc_ns + pf->now(pf->ctx).ns - mono_ns;
			return 0;
		}
	}
	return -EAGAIN;
}

static void note_locked(struct cycle *cy, enum dc_state before, int64_t error_ns)
{
	struct cycle_stats *st = cy->spec.stats;

	if (before != DC_LOCKED) {
		cycle_note(cy, EVENT_DC_LOCKED, (int64_t)cy->sample.cycle, error_ns, 0);
	}
	if (st->dc_lock_ns == 0) {
		SET(st->dc_lock_ns, mono_sub((mono_t){ cy->sample.wake_mono_ns }, cy->start).ns);
	}
	if (cy->sample.frame_dc_ns != 0) {
		histogram_add(&st->phase, error_ns);
	}
}

static void lose_lock(struct cycle *cy, int64_t error_ns)
{
	ADD(cy->spec.stats->dc_unlocks, 1);
	cycle_note(cy, EVENT_DC_UNLOCKED, (int64_t)cy->sample.cycle, error_ns, 0);
	if (cy->phase == CYCLE_OP && cy->spec.cfg->dc_unlock_policy == CONFIG_UNLOCK_STOP) {
		cycle_end_safely(cy, -ENOLCK);
	}
}

int cycle_is_unlocked_safe(const struct cycle *cy)
{
	return cy->spec.cfg->dc_unlock_policy == CONFIG_UNLOCK_FAIL_SAFE &&
	       (cy->servo.state == DC_ACQUIRING || cy->servo.state == DC_LOST);
}

/* A bit above all those of the limit. */
int64_t cycle_diff_proof_ns(int64_t limit_ns)
{
	int64_t proof_ns = 1;

	while (proof_ns <= limit_ns) {
		proof_ns *= 2;
	}
	return proof_ns;
}

static void watch_difference(struct cycle *cy, const struct exchange_result *res)
{
	struct cycle_stats *st = cy->spec.stats;
	int64_t limit_ns = cy->spec.cfg->dc_diff_limit_ns;
	int was_high = cy->is_diff_high;

	if (cy->phase != CYCLE_OP || res->dc_diff_ns < 0) {
		return;
	}
	if (cy->servo.state == DC_LOCKED && res->dc_diff_ns > st->dc_diff_max_ns) {
		SET(st->dc_diff_max_ns, res->dc_diff_ns);
	}
	cy->is_diff_high = res->dc_diff_ns >= cy->diff_proof_ns;
	if (cy->is_diff_high) {
		ADD(st->cycles_dc_diff_high, 1);
	}
	if (cy->is_diff_high && !was_high) {
		cycle_note(cy, EVENT_DC_DIFF_HIGH, (int64_t)cy->sample.cycle, res->dc_diff_ns,
			   limit_ns);
	}
}

int64_t cycle_follow(struct cycle *cy, const struct exchange_result *res)
{
	struct cycle_stats *st = cy->spec.stats;
	enum dc_state before = cy->servo.state;
	struct dc_servo_result servo;

	if (before == DC_OFF) {
		return 0;
	}
	if (res->status == EXCHANGE_NO_FRAME || res->dc_time_ns == 0) {
		servo = dc_servo_coast(&cy->servo);
	} else {
		servo = dc_servo_update(&cy->servo, res->dc_time_ns,
					mono_sub(res->sent, cy->deadline).ns);
		publish_dc(cy, res->dc_time_ns, res->sent.ns);
		cy->sample.frame_dc_ns = res->dc_time_ns;
		cy->sample.phase_error_ns = (int32_t)servo.error_ns;
	}
	if (cy->servo.state == DC_LOCKED) {
		note_locked(cy, before, servo.error_ns);
	} else {
		cy->sample.flags |= SAMPLE_DC_UNLOCKED;
		if (before == DC_LOCKED) {
			lose_lock(cy, servo.error_ns);
		}
	}
	watch_difference(cy, res);
	SET(st->dc_state, cy->servo.state);
	SET(st->correction_ppb, (int64_t)(cy->servo.integral_ns * 1e9 / (double)cy->period.ns));
	return servo.correction_ns;
}
