/* SPDX-License-Identifier: MIT */
/* The calibration run: one signal on the first two lines. Context: blocking. */
#ifndef SYNC0_CALIBRATE_LIVE_H
#define SYNC0_CALIBRATE_LIVE_H

#include <signal.h>
#include <stdio.h>

#include "config/config.h"

/**
 * Read the first two lines of @cfg until there are enough edges, compute, report to @out and store.
 * 0, or -errno with a line in @why (512): -EINTR: *@has_stopped, nothing is stored.
 */
int calibrate_live(const struct config *cfg, const char *dev_dir,
		   const volatile sig_atomic_t *has_stopped, FILE *out, char *why);

#endif
