/* SPDX-License-Identifier: MIT */
#include "sync0/alarm.h"

#include <math.h>

enum { GOOD_WINDOWS = 3 };

int32_t alarm_clamp(double v)
{
	return v >= INT32_MAX ? INT32_MAX : v <= INT32_MIN ? INT32_MIN : (int32_t)lround(v);
}

struct event alarm_event(const struct sync0_result *r, enum event_id id)
{
	return (struct event){
		.mono_ns = r->mono_ns,
		.tai_ns = r->tai_ns,
		.cycle = r->first_cycle,
		.value = (int64_t)r->first_cycle,
		.id = (uint16_t)id,
		.slave_pos = r->slave_pos,
		.line = r->line + 1u,
	};
}

/* The check's event with its figure and limit. Missing and extra pulses have events of their own.
 */
static struct event raised(const struct sync0_result *r, const struct judge_limits *limits,
			   enum sync0_check check)
{
	struct event ev = alarm_event(r, EVENT_SYNC0_PERIOD);
	double rate_over = fabs(r->rate_ppb) - limits->rate_ppb;

	switch (check) {
	case SYNC0_CHECK_PERIOD:
		if ((r->has & SYNC0_HAS_RATE) && rate_over > 0) {
			ev.arg[0] = alarm_clamp(r->rate_ppb);
			ev.arg[1] = alarm_clamp(limits->rate_ppb);
		} else {
			ev.arg[0] = alarm_clamp(r->drift_ppb);
			ev.arg[1] = alarm_clamp(limits->drift_ppb);
		}
		break;
	case SYNC0_CHECK_JITTER:
		ev.id = EVENT_SYNC0_JITTER;
		ev.arg[0] = alarm_clamp((double)r->jitter_p99_ns);
		ev.arg[1] = alarm_clamp((double)limits->jitter_ns);
		break;
	case SYNC0_CHECK_PHASE:
		ev.id = EVENT_SYNC0_PHASE;
		ev.arg[0] = alarm_clamp((double)(r->step_ns != 0 ? r->step_ns : r->phase_ns));
		ev.arg[1] = alarm_clamp((double)limits->phase_ns);
		break;
	case SYNC0_CHECK_SKEW:
		ev.id = EVENT_SYNC0_SKEW;
		ev.arg[0] = alarm_clamp((double)r->skew_ns);
		ev.arg[1] = alarm_clamp((double)limits->skew_ns);
		break;
	case SYNC0_CHECK_COUNT:
	case SYNC0_CHECKS:
		break;
	}
	return ev;
}

static int look(struct alarm_line *al, const struct sync0_result *r,
		const struct judge_limits *limits, enum sync0_check check, struct event *ret)
{
	enum sync0_verdict v = (enum sync0_verdict)r->check[check];

	if (v == SYNC0_FAIL) {
		al->good_windows[check] = 0;
		if (al->is_raised[check]) {
			return 0;
		}
		al->is_raised[check] = 1;
		*ret = raised(r, limits, check);
		return 1;
	}
	al->good_windows[check] = v == SYNC0_OK ? al->good_windows[check] + 1 : 0;
	if (!al->is_raised[check] || al->good_windows[check] < GOOD_WINDOWS) {
		return 0;
	}
	al->is_raised[check] = 0;
	*ret = alarm_event(r, EVENT_SYNC0_CLEAR);
	ret->arg[0] = (int32_t)check;
	return 1;
}

int alarm_window(struct alarm_line *al, const struct sync0_result *r,
		 const struct judge_limits *limits, alarm_emit emit, void *emit_ctx)
{
	int count = 0;

	for (int check = SYNC0_CHECK_PERIOD; check < SYNC0_CHECKS; check++) {
		struct event ev;

		if (look(al, r, limits, (enum sync0_check)check, &ev)) {
			emit(emit_ctx, &ev);
			count += al->is_raised[check];
		}
	}
	return count;
}
