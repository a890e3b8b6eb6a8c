/* SPDX-License-Identifier: MIT */
/*
 * Verdicts. A figure x with error e against a limit L: FAIL if even x - e is above L, OK if x + e
 * is not and x is clear of it, WARN if x is above 80 % of L, UNRESOLVED if e does not allow a
 * decision. The calibration of the board is part of every error; without one, phase and
 * skew cannot be judged. Context: any.
 */
#ifndef SYNC0_JUDGE_H
#define SYNC0_JUDGE_H

#include <stdint.h>

#include "base/sync0.h"

/* 0: no limit, not checked. */
struct judge_limits {
	double drift_ppb;
	double rate_ppb;
	int64_t jitter_ns;
	int64_t phase_ns;
	int64_t skew_ns;
};

/* Noise of the path from pin to timestamp, measured with one signal on two lines. */
struct judge_noise {
	int is_known;
	int64_t sd_ns;
	int64_t p99_ns; /* of |interval - mean| */
	int64_t max_ns;
	int has_pair;          /* first and second line are those of the calibration */
	int64_t bias_ns;       /* second line later than the first: order of interrupt service */
	int64_t bias_error_ns; /* of that; of other lines, the bias itself is the error */
};

/** Fill verdict, check and is_resolved of @r. @shift_ns: SYNC0 shift of the line. */
void judge(const struct judge_limits *limits, const struct judge_noise *noise, int64_t shift_ns,
	   struct sync0_result *r);

#endif
