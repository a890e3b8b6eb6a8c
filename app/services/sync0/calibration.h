/* SPDX-License-Identifier: MIT */
/*
 * What the GPIO path of this board adds of its own. The same signal is wired to two lines (or a
 * steady one to both): what their times differ by is the path, and so is the spread of each. A
 * small text file keeps it. Context: blocking.
 */
#ifndef SYNC0_CALIBRATION_H
#define SYNC0_CALIBRATION_H

#include <stddef.h>
#include <stdint.h>

#include "sync0/judge.h"

enum { CALIBRATION_EDGES_MIN = 1000, CALIBRATION_WHY_BYTES = 256 };

struct calibration {
	struct judge_noise noise;
	uint64_t pairs;
	double period_ns;
	char first[96]; /* the lines */
	char second[96];
};

/**
 * From the edges of two lines in order of time. 0; -ENODATA: too few of them belong together, with
 * the reason in @why (CALIBRATION_WHY_BYTES). @first_ns and @second_ns are used up.
 */
int calibration_compute(int64_t *first_ns, size_t first_count, int64_t *second_ns,
			size_t second_count, struct calibration *ret, char *why);

/** 0, or -errno with one line of reason in @why. */
int calibration_save(const char *path, const struct calibration *c, char *why);
/** 0; -ENOENT: there is none; -EBADMSG: it is none. */
int calibration_load(const char *path, struct calibration *ret);

#endif
