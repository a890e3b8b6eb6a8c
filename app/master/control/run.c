/* SPDX-License-Identifier: MIT */
/* One call a cycle, in the cycle's thread. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/histogram.h"
#include "control/control_internal.h"

#define ADD(field, n)                                                                              \
	atomic_store_explicit(&(field),                                                            \
			      atomic_load_explicit(&(field), memory_order_relaxed) + (n),          \
			      memory_order_relaxed)

void control_enter(struct control *control)
{
	guard_enter(&control->guard);
}

void control_leave(struct control *control)
{
	guard_leave(&control->guard);
}

static void set_state(struct control *ctl, enum control_state state)
{
	ctl->state_now = state;
	atomic_store_explicit(&ctl->spec.status->state, state, memory_order_relaxed);
}

static int is_resting(const struct control *ctl)
{
	return ctl->state_now == CONTROL_PARKED || ctl->state_now == CONTROL_STOPPED ||
	       ctl->state_now == CONTROL_CRASHED;
}

/* Post the program's current outputs, or none, on the board: a whole set each time. */
static void publish(struct control *ctl, int is_real)
{
	board_begin(&ctl->board);
	for (size_t i = 0; i < ctl->output_count; i++) {
		const struct control_output *out = &ctl->output[i];

		if (is_real && out->is_own && out->is_set) {
			board_put(&ctl->board, (unsigned)i, out->raw);
		} else {
			board_unset(&ctl->board, (unsigned)i);
		}
	}
	board_commit(&ctl->board);
}

static void forget_outputs(struct control *ctl)
{
	for (size_t i = 0; i < ctl->output_count; i++) {
		ctl->output[i].is_set = 0;
	}
}

static void make_safe(struct control *ctl, enum control_state state)
{
	forget_outputs(ctl);
	publish(ctl, 0);
	set_state(ctl, state);
	ctl->end_cycle = ctl->now.number;
}

static void call(void *ctx)
{
	struct control *ctl = ctx;

	ctl->verdict = ctl->program->cycle(&ctl->now, ctl->state);
}

static void describe_now(struct control *ctl, const struct sample_header *sample)
{
	ctl->slaves_bad = sample->slaves_bad;
	ctl->now = (struct ecdaq_cycle){
		.calls = &control_calls,
		.host = ctl,
		.number = sample->cycle,
		.dc_time_ns = sample->dc_time_ns,
		.period_ns = ctl->cfg->cycle_period_ns,
		.slaves_bad = ctl->slaves_bad.word,
		.slave_count = (uint32_t)ctl->spec.slave_count,
		.flags = sample->flags,
		.elapsed = (uint32_t)(sample->cycle - ctl->last_cycle),
	};
	if (!ctl->has_called) {
		ctl->now.flags |= ECDAQ_FIRST;
		ctl->now.elapsed = 0;
	}
	ctl->has_called = 1;
	ctl->last_cycle = sample->cycle;
}

/* 0, or -EFAULT if it crashed. */
static int call_timed(struct control *ctl)
{
	const struct platform *pf = &ctl->spec.platform;
	mono_t begin = pf->now(pf->ctx);
	int r;

	atomic_store_explicit(&ctl->entered_ns, begin.ns, memory_order_relaxed);
	r = guard_call(&ctl->guard, call, ctl);
	atomic_store_explicit(&ctl->entered_ns, 0, memory_order_relaxed);
	ctl->time_ns = mono_sub(pf->now(pf->ctx), begin).ns;
	ADD(ctl->spec.status->calls, 1);
	histogram_add(&ctl->spec.status->time, ctl->time_ns);
	return r;
}

static enum control_result overran(struct control *ctl)
{
	ADD(ctl->spec.status->overruns, 1);
	switch (ctl->cfg->control_overrun) {
	case CONFIG_OVERRUN_COUNT:
		return CONTROL_OVERRAN;
	case CONFIG_OVERRUN_FAIL_SAFE:
		make_safe(ctl, CONTROL_PARKED);
		return CONTROL_PARK;
	case CONFIG_OVERRUN_STOP:
		break;
	}
	make_safe(ctl, CONTROL_STOPPED);
	return CONTROL_STOP;
}

enum control_result control_run(struct control *control, const struct sample_header *sample,
				const uint8_t *image)
{
	struct control *ctl = control;

	if (is_resting(ctl)) {
		return CONTROL_REST;
	}
	ctl->image = image;
	describe_now(ctl, sample);
	if (call_timed(ctl) < 0) {
		make_safe(ctl, CONTROL_CRASHED);
		return CONTROL_CRASH;
	}
	publish(ctl, ctl->verdict == ECDAQ_GO_ON);
	set_state(ctl, ctl->verdict == ECDAQ_GO_ON ? CONTROL_RUNNING : CONTROL_SAFE);
	if (ctl->verdict != ECDAQ_GO_ON) {
		ADD(ctl->spec.status->safe_cycles, 1);
	}
	return ctl->time_ns > ctl->cfg->control_budget_ns ? overran(ctl) : CONTROL_DONE;
}

void control_pause(struct control *control)
{
	struct control *ctl = control;

	if (!ctl->has_called || ctl->state_now == CONTROL_STOPPED ||
	    ctl->state_now == CONTROL_CRASHED) {
		return;
	}
	ctl->has_called = 0;
	make_safe(ctl, CONTROL_WAITING);
}

int control_is_safe(const struct control *control)
{
	return control->state_now != CONTROL_RUNNING && control->state_now != CONTROL_WAITING;
}

int64_t control_time_ns(const struct control *control)
{
	return control->time_ns;
}

int64_t control_busy_ns(const struct control *control, mono_t now)
{
	int64_t entered_ns = atomic_load_explicit(&control->entered_ns, memory_order_relaxed);

	return entered_ns == 0 ? 0 : now.ns - entered_ns;
}

int control_crash(const struct control *control, struct control_crash *ret_crash)
{
	if (control->state_now != CONTROL_CRASHED) {
		return -ENODATA;
	}
	*ret_crash = (struct control_crash){
		.number = control->guard.number,
		.address = control->guard.address,
		.cycle = control->end_cycle,
	};
	return 0;
}

void control_describe_end(const struct control *control, char *text, size_t text_bytes)
{
	const char *path = control->cfg->control_program;

	text[0] = '\0';
	if (control->state_now == CONTROL_CRASHED) {
		snprintf(text, text_bytes,
			 "control: %s: crashed with SIG%s (at 0x%" PRIxPTR ") in cycle %" PRIu64
			 "; outputs made safe",
			 path, sigabbrev_np(control->guard.number), control->guard.address,
			 control->end_cycle);
	} else if (control->state_now == CONTROL_STOPPED) {
		snprintf(text, text_bytes,
			 "control: %s: took %" PRId64 " us of %" PRId64 " us (control.budget) in "
			 "cycle %" PRIu64 ", and control.overrun is stop",
			 path, control->time_ns / NS_PER_US,
			 control->cfg->control_budget_ns / NS_PER_US, control->end_cycle);
	}
}
