/* SPDX-License-Identifier: MIT */
/*
 * Uploads finished recordings, the oldest first, one at a time. A problem of the store holds up all
 * of them and is retried ever later; one of a recording holds up that one. Context: one thread;
 * blocks as long as the store answers.
 */
#ifndef UPLINK_UPLINK_H
#define UPLINK_UPLINK_H

#include <stddef.h>
#include <stdint.h>

#include "config/config.h"

struct uplink;

/** @cfg is kept; @report gets one line for each problem, and when it is over. 0; negative with a
 * line in @error: -EINVAL: an option is unusable. Free with uplink_destroy(). */
int uplink_create(const struct config *cfg, void (*report)(const char *line),
		  struct uplink **ret_uplink, char *error, size_t error_bytes);
void uplink_destroy(struct uplink *u);

/** Do what there is to do; how long to wait before the next call, ns. */
int64_t uplink_step(struct uplink *u);
/** 1: all finished recordings are uploaded, by the newest look. */
int uplink_is_idle(const struct uplink *u);

#endif
