/* SPDX-License-Identifier: MIT */
/*
 * The live check: the master's ring on one side, GPIO lines or the simulation's edge file on the
 * other, a checker for each session between them. Context: blocking.
 */
#ifndef SYNC0_WATCH_H
#define SYNC0_WATCH_H

#include <stdio.h>

#include "base/platform.h"
#include "config/config.h"

enum { WATCH_WHY_BYTES = 256 };

struct watch;

struct watch_spec {
	const struct config *cfg;
	const char *dev_dir; /* "/dev" */
	FILE *dump;          /* NULL; else every edge and cycle is written to it */
	struct platform platform;
};

/**
 * 0, or -errno with a line in @why (WATCH_WHY_BYTES): -ENOENT: there is nothing to watch; -EBUSY:
 * another process does. Free with watch_destroy().
 */
int watch_create(const struct watch_spec *spec, struct watch **ret_watch, char *why);
void watch_destroy(struct watch *w);
/** Take what is there; waits at most about 20 ms. */
void watch_step(struct watch *w);
/** End in order. */
void watch_finish(struct watch *w);

#endif
