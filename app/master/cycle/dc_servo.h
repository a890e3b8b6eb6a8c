/* SPDX-License-Identifier: MIT */
/*
 * The master follows the reference clock: from the DC time at which each frame passed the
 * reference, a correction of the host's next deadline, so that frames pass at SYNC0 plus the set
 * point. The reference is never written to (T22).
 *
 * One jump brings the phase near at the start, a PI controller holds it. The error is taken free
 * of the host's own send latency, which is known, so that a late wake does not look like drift.
 * Frames held up after that are outliers and left out.
 * Gains are per cycle; Kp 0.02 and Ki 0.0001 are critically damped. Context: cycle thread, RT-safe.
 */
#ifndef CYCLE_DC_SERVO_H
#define CYCLE_DC_SERVO_H

#include <stdint.h>

#include "base/status.h"

struct dc_servo_spec {
	int64_t period_ns;
	int64_t set_point_ns;    /* of the frame after SYNC0, in (0, period) */
	int64_t lock_limit_ns;   /* lock: filtered |error| below this, and the raw one not above
				    unlock_limit, */
	uint32_t lock_cycles;    /* number of cycles (leaky) */
	int64_t unlock_limit_ns; /* lock lost: |error| above this for 200 cycles (leaky) */
	int64_t slew_ns;         /* largest correction a cycle, after the jump */
	double kp;
	double ki;
};

struct dc_servo {
	struct dc_servo_spec spec;
	enum dc_state state;
	double integral_ns;  /* correction that holds the frequency */
	double filtered_ns;  /* error, smoothed over about 16 cycles */
	double remainder_ns; /* part of a ns that is still owed */
	int is_phase_known;  /* 0: the next measurement jumps to it */
	uint32_t in_window;  /* leaky count towards lock */
	uint32_t out_window; /* leaky count towards unlock */
	uint32_t far_off;    /* leaky count towards another jump */
	uint32_t outliers;   /* leaky count towards a step of the clock */
	uint32_t coasted;    /* cycles without a measurement */
};

struct dc_servo_result {
	int64_t error_ns;      /* folded phase error of this frame; 0 when coasting */
	int64_t correction_ns; /* add to the next deadline */
};

void dc_servo_init(struct dc_servo *servo, const struct dc_servo_spec *spec);

/**
 * @frame_dc_ns: system time of the reference as the frame passed. @send_latency_ns: how much later
 * than its deadline the frame was sent.
 */
struct dc_servo_result dc_servo_update(struct dc_servo *servo, int64_t frame_dc_ns,
				       int64_t send_latency_ns);

/**
 * No measurement in this cycle: keep the frequency, however long it lasts. After 200 such cycles
 * lock is lost, and the next measurement is jumped to.
 */
struct dc_servo_result dc_servo_coast(struct dc_servo *servo);

#endif
