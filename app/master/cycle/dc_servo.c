/* SPDX-License-Identifier: MIT */
#include "cycle/dc_servo.h"

#include <math.h>
#include <stdlib.h>

#include "base/clock.h"

/* Two crystals of +-100 ppm against each other, and some room. */
#define INTEGRAL_LIMIT_PPM 300.0
#define FILTER_SHARE (1.0 / 16.0)

enum {
	LOSS_CYCLES = 200, /* lock is lost after this long outside the window, far off or without a
			      measurement */
	LEAK_CYCLES = 2,   /* subtracted for one cycle in the wrong place */
	CLAMP_LIMITS = 5,  /* a frame with an error of so many lock limits is an outlier; if it is
			      used, it counts for so many */
	STEP_CYCLES = 32,  /* so many outliers (leaky) are a step of the clock */
};

void dc_servo_init(struct dc_servo *servo, const struct dc_servo_spec *spec)
{
	*servo = (struct dc_servo){ .spec = *spec, .state = DC_ACQUIRING };
}

static double clamp(double v, double limit)
{
	return v > limit ? limit : v < -limit ? -limit : v;
}

/* Leaky: one cycle in the right place counts one up, one in the wrong place LEAK_CYCLES down. */
static uint32_t leak(uint32_t count, int is_in)
{
	if (is_in) {
		return count + 1;
	}
	return count > LEAK_CYCLES ? count - LEAK_CYCLES : 0;
}

static struct dc_servo_result apply(struct dc_servo *servo, double error_ns, double correction_ns)
{
	double whole;

	servo->remainder_ns += correction_ns;
	whole = floor(servo->remainder_ns);
	servo->remainder_ns -= whole;
	return (struct dc_servo_result){ .error_ns = (int64_t)error_ns,
					 .correction_ns = (int64_t)whole };
}

/* Deadlines only ever move back in a jump: moving forward could land in the past. The frequency
 * learnt so far stays. */
static struct dc_servo_result jump(struct dc_servo *servo, int64_t error_ns)
{
	servo->is_phase_known = 1;
	servo->filtered_ns = 0;
	servo->far_off = 0;
	servo->outliers = 0;
	servo->in_window = 0;
	return (struct dc_servo_result){
		.error_ns = error_ns,
		.correction_ns = mod_floor(-error_ns, servo->spec.period_ns),
	};
}

/*
 * 1: leave this frame out. A frame that reaches the reference late, since the host or a simulated
 * segment is busy, shows an error that always has the same sign. Used, even clamped, it shifts the
 * frequency (by 100 ppm, if it is one frame in ten) and keeps the smoothed error outside the
 * window. If more than two of three frames are outliers, the clock itself is there: they are used.
 */
static int judge_outlier(struct dc_servo *servo, int is_clamped)
{
	servo->outliers = leak(servo->outliers, is_clamped);
	if (servo->outliers < STEP_CYCLES) {
		return is_clamped;
	}
	servo->outliers = STEP_CYCLES;
	return 0;
}

/*
 * Lock is gained by the smoothed error, which one wild frame does not move; it is lost, and never
 * gained, by raw errors that are large most of the time: noise without a clock behind it smooths to
 * nothing, too.
 */
static void judge(struct dc_servo *servo, int64_t error_ns)
{
	const struct dc_servo_spec *spec = &servo->spec;
	int is_wild = llabs(error_ns) > spec->unlock_limit_ns;
	int is_near = fabs(servo->filtered_ns) < (double)spec->lock_limit_ns;

	servo->in_window = leak(servo->in_window, is_near && !is_wild);
	servo->out_window = leak(servo->out_window, is_wild);
	if (servo->state != DC_LOCKED && servo->in_window >= spec->lock_cycles) {
		servo->state = DC_LOCKED;
		servo->out_window = 0;
	} else if (servo->state == DC_LOCKED && servo->out_window >= LOSS_CYCLES) {
		servo->state = DC_LOST;
		servo->in_window = 0;
	}
}

struct dc_servo_result dc_servo_update(struct dc_servo *servo, int64_t frame_dc_ns,
				       int64_t send_latency_ns)
{
	const struct dc_servo_spec *spec = &servo->spec;
	int64_t error_ns =
		fold_ns(frame_dc_ns - send_latency_ns - spec->set_point_ns, spec->period_ns);
	double clamp_ns = (double)(CLAMP_LIMITS * spec->lock_limit_ns);
	int is_clamped = fabs((double)error_ns) >= clamp_ns;
	double used_ns = clamp((double)error_ns, clamp_ns);
	double integral_limit_ns = INTEGRAL_LIMIT_PPM * 1e-6 * (double)spec->period_ns;
	double correction_ns;

	servo->coasted = 0;
	if (!servo->is_phase_known) {
		return jump(servo, error_ns);
	}
	servo->far_off = leak(servo->far_off, llabs(error_ns) > spec->period_ns / 8);
	if (servo->far_off >= LOSS_CYCLES) {
		servo->state = servo->state == DC_LOCKED ? DC_LOST : servo->state;
		return jump(servo, error_ns);
	}
	if (judge_outlier(servo, is_clamped)) {
		used_ns = 0;
	} else {
		servo->filtered_ns += FILTER_SHARE * (used_ns - servo->filtered_ns);
	}
	/* A clamped error gives the direction, not the difference in rate. */
	if (!is_clamped) {
		servo->integral_ns =
			clamp(servo->integral_ns - spec->ki * used_ns, integral_limit_ns);
	}
	judge(servo, error_ns);
	correction_ns = clamp(servo->integral_ns - spec->kp * used_ns, (double)spec->slew_ns);
	return apply(servo, (double)error_ns, correction_ns);
}

struct dc_servo_result dc_servo_coast(struct dc_servo *servo)
{
	if (servo->coasted < LOSS_CYCLES) {
		servo->coasted++;
	} else if (servo->state == DC_LOCKED) {
		servo->state = DC_LOST;
		servo->is_phase_known = 0; /* jump to the next measurement */
	}
	return apply(servo, 0, servo->integral_ns);
}
