/* SPDX-License-Identifier: MIT */
/*
 * Alarms with hysteresis: a check that fails raises one; it is cleared by three clearly good
 * windows in a row, so that a figure at its limit does not flutter. Context: any.
 */
#ifndef SYNC0_ALARM_H
#define SYNC0_ALARM_H

#include "base/event.h"
#include "base/sync0.h"
#include "sync0/judge.h"

struct alarm_line {
	int is_raised[SYNC0_CHECKS];
	int good_windows[SYNC0_CHECKS];
};

typedef void (*alarm_emit)(void *ctx, const struct event *ev);

/** Look at a judged window of the line. Returns how many alarms were raised. */
int alarm_window(struct alarm_line *al, const struct sync0_result *r,
		 const struct judge_limits *limits, alarm_emit emit, void *emit_ctx);

/** An event about the line of @r (its slave, line and time), not filled further. */
struct event alarm_event(const struct sync0_result *r, enum event_id id);
/** @v as an event's argument holds it. */
int32_t alarm_clamp(double v);

#endif
