/* SPDX-License-Identifier: MIT */
/*
 * Edges that passed while the master was late. A step does three things for them, each in one
 * place: the number goes on (cycle_pass_edges), the deadline moves (cycle.c: move_deadline), and
 * after the late frame has gone out the skipped samples are written and cycle.overrun decides
 * (cycle_report_skipped).
 */
#include <errno.h>

#include "base/slave_set.h"
#include "cycle/cycle_internal.h"

void cycle_pass_edges(struct cycle *cy, uint64_t count)
{
	cy->sample.cycle += count;
}

static void push_skipped(struct cycle *cy, uint64_t first, uint64_t count)
{
	struct sample_header kept = cy->sample;

	cy->sample = (struct sample_header){
		.wake_mono_ns = kept.wake_mono_ns,
		.wake_tai_ns = kept.wake_tai_ns,
		.wake_latency_ns = kept.wake_latency_ns,
		.round_trip_ns = -1,
		.dc_diff_ns = -1,
		.wkc_expected = kept.wkc_expected,
		.flags = SAMPLE_SKIPPED | (kept.flags & (SAMPLE_FAIL_SAFE | SAMPLE_DC_UNLOCKED)),
		.slaves_bad = cy->all,
	};
	for (uint64_t i = 0; i < count; i++) {
		cy->sample.cycle = first + i;
		cy->sample.dc_time_ns = numbering_dc_time(&cy->numbering, first + i);
		cycle_push_sample(cy);
	}
	cy->sample = kept;
}

static void count_skipped(struct cycle *cy, uint64_t count)
{
	struct cycle_stats *st = cy->spec.stats;

	ADD(st->overruns, 1);
	ADD(st->cycles_skipped, count);
	ADD(st->samples_bad, count * slave_set_count(&cy->live));
	for (unsigned i = slave_set_next(&cy->live, 0); i < LIMIT_SLAVES;
	     i = slave_set_next(&cy->live, i + 1)) {
		ADD(st->slave_bad[i], count);
	}
}

/* Reaction to an overrun; before OP nothing is controlled yet. */
static void apply_policy(struct cycle *cy)
{
	if (cy->phase != CYCLE_OP) {
		return;
	}
	switch (cy->spec.cfg->cycle_overrun) {
	case CONFIG_OVERRUN_COUNT:
		break;
	case CONFIG_OVERRUN_FAIL_SAFE:
		cy->is_latched_safe = 1;
		break;
	case CONFIG_OVERRUN_STOP:
		cycle_end_safely(cy, -ETIME);
		break;
	}
}

void cycle_report_skipped(struct cycle *cy)
{
	uint64_t first = cy->numbering.next;
	uint64_t count = cy->sample.cycle - first;

	if (count == 0) {
		return;
	}
	count_skipped(cy, count);
	cycle_note(cy, EVENT_OVERRUN, (int64_t)first, (int64_t)count, cy->sample.wake_latency_ns);
	if (count > NUMBERING_SKIP_LIMIT) {
		cycle_note(cy, EVENT_NUMBERING_JUMP, (int64_t)cy->sample.cycle, (int64_t)count, 0);
	} else {
		push_skipped(cy, first, count);
	}
	apply_policy(cy);
}
