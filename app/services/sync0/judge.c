/* SPDX-License-Identifier: MIT */
#include "sync0/judge.h"

#include <math.h>
#include <stdlib.h>

#define CLEAR_SHARE 0.8    /* of the limit: below it is clearly within */
#define RESOLVED_RATIO 1.2 /* a spread has to be this much wider than the noise to be seen */
#define EXTRA_SHARE 100    /* more than one extra pulse in so many cycles fails */

static enum sync0_verdict worse(enum sync0_verdict a, enum sync0_verdict b)
{
	return a > b ? a : b;
}

static enum sync0_verdict grade(double figure, double error, double limit)
{
	if (limit <= 0) {
		return SYNC0_NONE;
	}
	if (figure - error > limit) {
		return SYNC0_FAIL;
	}
	if (figure + error > limit) {
		return SYNC0_UNRESOLVED;
	}
	return figure > CLEAR_SHARE * limit ? SYNC0_WARN : SYNC0_OK;
}

static enum sync0_verdict judge_count(const struct sync0_result *r)
{
	if (r->is_disturbed) {
		return SYNC0_WARN;
	}
	if (r->missing > 0 || r->edges == 0 || r->extra > r->cycles / EXTRA_SHARE) {
		return SYNC0_FAIL;
	}
	return r->extra > 0 || r->overflow > 0 ? SYNC0_WARN : SYNC0_OK;
}

static enum sync0_verdict judge_period(const struct judge_limits *limits,
				       const struct sync0_result *r)
{
	enum sync0_verdict v = SYNC0_NONE;

	if (r->has & SYNC0_HAS_DRIFT) {
		v = grade(fabs(r->drift_ppb), r->drift_error_ppb, limits->drift_ppb);
	}
	if (r->has & SYNC0_HAS_RATE) {
		v = worse(v, grade(fabs(r->rate_ppb), r->rate_error_ppb, limits->rate_ppb));
	}
	return v;
}

/* Phase of the pulse: requires the calibrated delay from the pin to the timestamp. */
static enum sync0_verdict grade_place(const struct judge_noise *noise, int64_t off_ns,
				      int64_t error_ns, int64_t limit_ns)
{
	enum sync0_verdict v =
		grade((double)llabs(off_ns), (double)(error_ns + noise->max_ns), (double)limit_ns);

	return v == SYNC0_NONE || noise->is_known ? v : SYNC0_UNRESOLVED;
}

/* What is measured holds the noise, too: it is a bound from above. */
static enum sync0_verdict judge_jitter(const struct judge_limits *limits,
				       const struct judge_noise *noise,
				       const struct sync0_result *r)
{
	if (limits->jitter_ns == 0 || !(r->has & SYNC0_HAS_PERIOD)) {
		return SYNC0_NONE;
	}
	if (r->jitter_p99_ns <= limits->jitter_ns) {
		return SYNC0_OK;
	}
	if (!noise->is_known || r->jitter_p99_ns <= limits->jitter_ns + noise->p99_ns) {
		return SYNC0_UNRESOLVED;
	}
	return SYNC0_FAIL;
}

static enum sync0_verdict judge_phase(const struct judge_limits *limits,
				      const struct judge_noise *noise, int64_t shift_ns,
				      const struct sync0_result *r)
{
	if (r->step_ns != 0 && !r->is_disturbed) {
		return noise->is_known && limits->phase_ns > 0 &&
				       llabs(r->step_ns) > limits->phase_ns
			       ? SYNC0_FAIL
			       : SYNC0_WARN;
	}
	if (!(r->has & SYNC0_HAS_PHASE)) {
		return SYNC0_NONE;
	}
	return grade_place(noise, r->phase_ns - shift_ns, r->phase_error_ns, limits->phase_ns);
}

static enum sync0_verdict judge_skew(const struct judge_limits *limits,
				     const struct judge_noise *noise, const struct sync0_result *r)
{
	enum sync0_verdict v;

	if (!(r->has & SYNC0_HAS_SKEW) || limits->skew_ns == 0) {
		return SYNC0_NONE;
	}
	if (!noise->is_known) {
		return SYNC0_UNRESOLVED;
	}
	v = grade((double)llabs(r->skew_ns), (double)r->skew_error_ns, (double)limits->skew_ns);
	return v;
}

/* Which figures exceed the noise of the measurement itself. */
static uint32_t resolved(const struct judge_noise *noise, int64_t shift_ns,
			 const struct sync0_result *r)
{
	uint32_t bits = 0;

	if (r->has & SYNC0_HAS_PERIOD) {
		bits |= SYNC0_HAS_PERIOD;
		if (noise->is_known &&
		    (double)r->jitter_p99_ns > RESOLVED_RATIO * (double)noise->p99_ns &&
		    r->jitter_p99_ns > 0) {
			bits |= SYNC0_HAS_JITTER;
		}
	}
	if ((r->has & SYNC0_HAS_DRIFT) && fabs(r->drift_ppb) > r->drift_error_ppb) {
		bits |= SYNC0_HAS_DRIFT;
	}
	if ((r->has & SYNC0_HAS_RATE) && fabs(r->rate_ppb) > r->rate_error_ppb) {
		bits |= SYNC0_HAS_RATE;
	}
	if ((r->has & SYNC0_HAS_PHASE) && noise->is_known &&
	    llabs(r->phase_ns - shift_ns) > r->phase_error_ns + noise->max_ns) {
		bits |= SYNC0_HAS_PHASE;
	}
	if ((r->has & SYNC0_HAS_SKEW) && noise->is_known && llabs(r->skew_ns) > r->skew_error_ns) {
		bits |= SYNC0_HAS_SKEW;
	}
	return bits;
}

static enum sync0_verdict judge_shot(const struct judge_limits *limits,
				     const struct judge_noise *noise, const struct sync0_result *r)
{
	if (!r->has_come) {
		return SYNC0_FAIL;
	}
	return grade_place(noise, r->shot_late_ns, r->phase_error_ns, limits->phase_ns);
}

void judge(const struct judge_limits *limits, const struct judge_noise *noise, int64_t shift_ns,
	   struct sync0_result *r)
{
	enum sync0_verdict v = SYNC0_NONE;

	for (int i = 0; i < SYNC0_CHECKS; i++) {
		r->check[i] = SYNC0_NONE;
	}
	if (r->kind == SYNC0_SHOT) {
		r->check[SYNC0_CHECK_COUNT] = r->has_come ? SYNC0_OK : SYNC0_FAIL;
		r->check[SYNC0_CHECK_PHASE] = (uint8_t)judge_shot(limits, noise, r);
		r->is_resolved =
			r->has_come && noise->is_known &&
					llabs(r->shot_late_ns) > r->phase_error_ns + noise->max_ns
				? SYNC0_HAS_PHASE
				: 0;
	} else {
		r->check[SYNC0_CHECK_COUNT] = (uint8_t)judge_count(r);
		r->check[SYNC0_CHECK_PERIOD] = (uint8_t)judge_period(limits, r);
		r->check[SYNC0_CHECK_JITTER] = (uint8_t)judge_jitter(limits, noise, r);
		r->check[SYNC0_CHECK_PHASE] = (uint8_t)judge_phase(limits, noise, shift_ns, r);
		r->check[SYNC0_CHECK_SKEW] = (uint8_t)judge_skew(limits, noise, r);
		r->is_resolved = resolved(noise, shift_ns, r);
	}
	for (int i = 0; i < SYNC0_CHECKS; i++) {
		v = worse(v, (enum sync0_verdict)r->check[i]);
	}
	r->verdict = (uint8_t)v;
}
