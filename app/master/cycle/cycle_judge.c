/* SPDX-License-Identifier: MIT */
#include "cycle/cycle_internal.h"

#include <errno.h>

#include "base/slave_set.h"

static struct slave_set all_slaves(const struct cycle *cy)
{
	return slave_set_all(cy->spec.slave_count);
}

void cycle_push_sample(struct cycle *cy)
{
	ring_push(cy->spec.samples, &cy->sample, sample_head_bytes((uint32_t)cy->spec.slave_count),
		  cy->image, cy->spec.plan->image_bytes);
}

static uint64_t whole_periods(const struct cycle *cy, int64_t ns)
{
	return ns > 0 ? (uint64_t)(ns / cy->period.ns) : 0;
}

/*
 * Edges by which the number was behind when the frame was sent, though this master was not late:
 * the deadline is right as it is. Moved with the number, it would pass one more edge in every
 * cycle.
 */
static uint64_t passed_before_sending(const struct cycle *cy, const struct exchange_result *res)
{
	int64_t round_trip_ns = res->round_trip.ns > 0 ? res->round_trip.ns : 0;
	int64_t late_ns = mono_sub(res->sent, cy->deadline).ns;
	int64_t since_edge_ns = res->dc_time_ns - round_trip_ns -
				numbering_dc_time(&cy->numbering, cy->sample.cycle);
	uint64_t passed = whole_periods(cy, since_edge_ns);
	uint64_t late = numbering_skipped(cy->period.ns, cy->set_point_ns, late_ns);

	/* Locked, a punctual frame passes at the set point, half a period from being misjudged: one
	 * that was sent just before an edge, and delayed past it, is late. */
	if (cy->servo.state == DC_LOCKED) {
		return whole_periods(cy, since_edge_ns - late_ns - cy->set_point_ns +
						 cy->period.ns / 2);
	}
	return passed > late ? passed - late : 0;
}

/*
 * The time is that of the first frame. The others passed the slaves later, at the latest when the
 * last one was back: after the next edge their inputs may be those of that edge.
 */
static int is_torn(const struct cycle *cy, const struct exchange_result *res)
{
	int64_t since_edge_ns =
		mod_floor(res->dc_time_ns - numbering_dc_time(&cy->numbering, cy->sample.cycle),
			  cy->period.ns);

	return exchange_frame_count(cy->spec.plan) > 1 &&
	       since_edge_ns + res->round_trip.ns >= cy->period.ns;
}

struct cycle_place cycle_place(struct cycle *cy, const struct exchange_result *res)
{
	struct cycle_place ret = { .is_in_window = 1 };
	struct numbering_place place;

	if (cy->phase == CYCLE_CLOCKS || cy->servo.state == DC_OFF) {
		return ret;
	}
	if (res->dc_time_ns == 0) {
		ret.is_in_window = 0; /* the edge of these inputs is unknown */
		return ret;
	}
	place = numbering_place(&cy->numbering, cy->sample.cycle, res->dc_time_ns);
	if (place.was_rebased) {
		cycle_note(cy, EVENT_NUMBERING_JUMP, (int64_t)cy->sample.cycle, 0, 0);
		check_restart(&cy->check);
	}
	if (place.passed_edges > 0) {
		uint64_t behind = passed_before_sending(cy, res);

		ret.passed_edges = place.passed_edges;
		ret.late_periods = place.passed_edges > behind ? place.passed_edges - behind : 0;
	}
	ret.is_in_window = place.is_in_window && !is_torn(cy, res);
	return ret;
}

/* A slave that is not live is not counted. Only a wrong counter in a fresh frame is unexplained. */
static void count_samples(struct cycle *cy, const struct slave_set *wrong)
{
	struct cycle_stats *st = cy->spec.stats;

	for (unsigned i = slave_set_next(&cy->live, 0); i < LIMIT_SLAVES;
	     i = slave_set_next(&cy->live, i + 1)) {
		if (slave_set_has(&cy->sample.slaves_bad, i)) {
			ADD(st->samples_bad, 1);
			ADD(st->slave_bad[i], 1);
		} else {
			ADD(st->samples_good, 1);
			ADD(st->slave_good[i], 1);
		}
		ADD(st->samples_bad_unexplained, slave_set_has(wrong, i) ? 1u : 0u);
	}
}

int cycle_has_inputs(const struct cycle *cy, const struct exchange_result *res)
{
	return res->status == EXCHANGE_OK ||
	       (res->status == EXCHANGE_WKC_LOW && cy->spec.plan->is_split);
}

static void report_wrong(struct cycle *cy, const struct check_fault *fault)
{
	struct event ev = { .id = EVENT_COUNTER_BAD,
			    .slave_pos = fault->slave_pos,
			    .value = (int64_t)cy->sample.cycle,
			    .arg = { (int32_t)fault->seen, (int32_t)fault->expected } };

	cy->sample.flags |= SAMPLE_BAD_COUNTER;
	cycle_emit(cy, &ev);
}

void cycle_judge(struct cycle *cy, const struct exchange_result *res, int is_in_window)
{
	int is_fresh = cycle_has_inputs(cy, res);
	struct check_result checked = { .wrong = slave_set_empty() };
	struct slave_set stale = all_slaves(cy);

	cy->sample.slaves_bad = stale;
	if (slave_set_is_empty(&cy->live)) {
		cy->sample.flags |= SAMPLE_NOT_OP;
		return;
	}
	if (is_fresh && is_in_window) {
		slave_set_and_not(&stale, &cy->live);
		slave_set_or(&stale, &res->slaves_low);
		checked = check_image(&cy->check, cy->image, cy->sample.cycle, &stale);
		cy->sample.slaves_bad = stale;
		slave_set_or(&cy->sample.slaves_bad, &checked.wrong);
		slave_set_or(&cy->sample.slaves_bad, &checked.unknown);
	}
	if (!slave_set_is_empty(&checked.unknown)) {
		cy->sample.flags |= SAMPLE_UNCHECKED;
	}
	if (!slave_set_is_empty(&checked.wrong)) {
		report_wrong(cy, &checked.first);
	}
	count_samples(cy, &checked.wrong);
}
