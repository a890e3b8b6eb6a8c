/* SPDX-License-Identifier: MIT */
#include "cycle/cycle_internal.h"

#include <errno.h>

#include "base/slave_set.h"

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

static unsigned bits(uint64_t word)
{
	return (unsigned)__builtin_popcountll(word);
}

/* One more sample of each slave in @word, the @w-th of a set. */
static void count_slaves(_Atomic uint64_t *counts, unsigned w, uint64_t word)
{
	struct slave_run run;

	while (slave_set_take_run(&word, w, &run)) {
		for (unsigned pos = run.first; pos < run.end; pos++) {
			ADD(counts[pos], 1);
		}
	}
}

/* A slave that is not live is not counted. Only a wrong counter in a fresh frame is unexplained. */
static void count_samples(struct cycle *cy, const struct check_result *checked)
{
	struct cycle_stats *st = cy->spec.stats;

	for (unsigned w = 0; w < cy->set_words; w++) {
		uint64_t live = cy->live.word[w];
		uint64_t bad = live & cy->sample.slaves_bad.word[w];

		count_slaves(st->slave_good, w, live & ~bad);
		ADD(st->samples_good, bits(live & ~bad));
		if (bad != 0) {
			count_slaves(st->slave_bad, w, bad);
			ADD(st->samples_bad, bits(bad));
			ADD(st->samples_bad_unexplained,
			    checked->has_wrong ? bits(live & checked->wrong.word[w]) : 0);
		}
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

/* The slaves whose part of a fresh image is good: what check_image() finds comes on top. */
static void judge_image(struct cycle *cy, const struct exchange_result *res,
			struct check_result *checked)
{
	struct slave_set stale = cy->all;

	for (unsigned w = 0; w < cy->set_words; w++) {
		stale.word[w] &= ~cy->live.word[w];
		stale.word[w] |= res->slaves_low.word[w];
	}
	check_image(&cy->check, cy->image, cy->sample.cycle, &stale, checked);
	for (unsigned w = 0; w < cy->set_words; w++) {
		cy->sample.slaves_bad.word[w] =
			stale.word[w] | checked->wrong.word[w] | checked->unknown.word[w];
	}
}

void cycle_judge(struct cycle *cy, const struct exchange_result *res, int is_in_window)
{
	struct check_result checked = { .has_wrong = 0 };

	cy->sample.slaves_bad = cy->all;
	if (!cy->has_live) {
		cy->sample.flags |= SAMPLE_NOT_OP;
		return;
	}
	if (cycle_has_inputs(cy, res) && is_in_window) {
		judge_image(cy, res, &checked);
	}
	if (checked.has_unknown) {
		cy->sample.flags |= SAMPLE_UNCHECKED;
	}
	if (checked.has_wrong) {
		report_wrong(cy, &checked.first);
	}
	count_samples(cy, &checked);
}
