/* SPDX-License-Identifier: MIT */
/* Recorded edges through the same check. Context: blocking. */
#ifndef SYNC0_REPLAY_H
#define SYNC0_REPLAY_H

#include <stdio.h>

#include "config/config.h"

enum replay_form { REPLAY_TEXT, REPLAY_JSON };

struct replay_spec {
	const struct config *cfg; /* period, window, limits, calibration */
	const char *path;
	enum replay_form form;
	FILE *out;
};

enum replay_outcome { REPLAY_GOOD, REPLAY_BAD };

/**
 * Analyse the file and write what is found. 0 and whether any check failed, an edge is missing or
 * a shot was lost; or -errno with a line in @why (512).
 */
int replay(const struct replay_spec *spec, enum replay_outcome *ret_outcome, char *why);

/** The same file as the calibration of two lines. 0 or -errno with @why. */
int replay_calibrate(const char *path, const char *save_to, FILE *out, char *why);

#endif
