/* SPDX-License-Identifier: MIT */
#include "cycle/cycle.h"

#include <errno.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/resource.h>

#include "base/slave_set.h"
#include "control/program.h"
#include "cycle/cycle_internal.h"

enum {
	STACK_BYTES = 64 * 1024, /* touched before the first cycle */
	FAULT_CHECK_CYCLES = 64, /* how often the thread's page faults are read */
	SETTLE_SHARE = 20,       /* slaves have a 20th of the period to put their inputs in place */
	RIDE_PERCENT = 85,       /* answers to service frames are looked for until then */
};

int cycle_create(const struct cycle_spec *spec, struct cycle **ret_cycle, char *error,
		 size_t error_bytes)
{
	const struct config *cfg = spec->cfg;
	struct cycle *cy = calloc(1, sizeof(*cy));
	int r;

	if (cy == NULL) {
		return -ENOMEM;
	}
	cy->spec = *spec;
	cy->period = (span_t){ cfg->cycle_period_ns };
	cy->set_point_ns =
		(int64_t)((double)cfg->cycle_period_ns * cfg->cycle_phase_percent / 100.0);
	cy->receive_ns =
		(int64_t)((double)cfg->cycle_period_ns * cfg->cycle_receive_percent / 100.0);
	cy->diff_proof_ns = cycle_diff_proof_ns(cfg->dc_diff_limit_ns);
	dc_servo_init(&cy->servo, &(struct dc_servo_spec){
					  .period_ns = cfg->cycle_period_ns,
					  .set_point_ns = cy->set_point_ns,
					  .lock_limit_ns = cfg->dc_lock_limit_ns,
					  .lock_cycles = cfg->dc_lock_cycles,
					  .unlock_limit_ns = cfg->dc_unlock_limit_ns,
					  .slew_ns = cfg->dc_slew_ns,
					  .kp = cfg->dc_kp,
					  .ki = cfg->dc_ki,
				  });
	if (spec->plan->dc_reference == 0) {
		cy->servo.state = DC_OFF;
	}
	numbering_init(&cy->numbering, cfg->cycle_period_ns, cfg->cycle_period_ns / SETTLE_SHARE);
	check_init(&cy->check, cfg, spec->slaves, spec->slave_count, spec->channels);
	r = outputs_init(&cy->outputs, spec, error, error_bytes);
	if (r < 0) {
		free(cy);
		return r;
	}
	outputs_choose(&cy->outputs, cy->image, &(struct slave_set){ 0 }, 0);
	cy->was_fail_safe = 1;
	cy->all = slave_set_all(spec->slave_count);
	cy->set_words = slave_set_words(spec->slave_count);
	cycle_slaves_init(cy);
	cy->slaves_found = spec->plan->slave_count;
	*ret_cycle = cy;
	return 0;
}

void cycle_destroy(struct cycle *cycle)
{
	free(cycle);
}

/* --- wake --- */

static void change_phase(struct cycle *cy)
{
	enum cycle_phase wanted =
		(enum cycle_phase)atomic_load_explicit(&cy->wanted_phase, memory_order_acquire);

	if (wanted == cy->phase) {
		return;
	}
	if (wanted == CYCLE_OP) {
		check_restart(&cy->check);
		cy->is_latched_safe = cy->last_steps > 0;
	}
	cy->phase = wanted;
}

/*
 * The deadline moves here and nowhere else: by the periods that a late master has passed over
 * (wake() and cycle_step()), then by the period and the servo's correction.
 */
static void move_deadline(struct cycle *cy, uint64_t periods, int64_t correction_ns)
{
	cy->deadline = mono_add(cy->deadline,
				(span_t){ (int64_t)periods * cy->period.ns + correction_ns });
}

static mono_t wake(struct cycle *cy)
{
	const struct platform *pf = &cy->spec.platform;
	uint64_t skipped;
	mono_t now;

	if (!cy->has_started) {
		cy->has_started = 1;
		cy->start = pf->now(pf->ctx);
		cy->deadline = mono_add(cy->start, cy->period);
	}
	pf->sleep_until(pf->ctx, cy->deadline);
	now = pf->now(pf->ctx);
	change_phase(cy);
	cycle_update_live(cy);
	cy->sample = (struct sample_header){
		.cycle = cy->numbering.next,
		.wake_mono_ns = now.ns,
		.wake_tai_ns = pf->tai_ns(pf->ctx),
		.round_trip_ns = -1,
		.dc_diff_ns = -1,
		.wkc_expected = cy->spec.plan->wkc_expected,
	};
	cy->sample.wake_latency_ns = (int32_t)mono_sub(now, cy->deadline).ns;
	if (mono_sub(now, cy->deadline).ns > INT32_MAX) {
		cy->sample.wake_latency_ns = INT32_MAX;
	}
	histogram_add(&cy->spec.stats->wake_latency, mono_sub(now, cy->deadline).ns);
	/* Woken after the next SYNC0: the edges in between are lost to this master. */
	skipped =
		numbering_skipped(cy->period.ns, cy->set_point_ns, mono_sub(now, cy->deadline).ns);
	cycle_pass_edges(cy, skipped);
	move_deadline(cy, skipped, 0);
	return now;
}

/* --- exchange --- */

static mono_t receive_deadline(const struct cycle *cy, mono_t now)
{
	mono_t wanted = mono_add(now, (span_t){ cy->receive_ns });
	mono_t last = mono_add(cy->deadline, (span_t){ cy->period.ns * 9 / 10 });
	mono_t least = mono_add(now, (span_t){ cy->period.ns / 10 });

	if (wanted.ns > last.ns) {
		wanted = last;
	}
	return wanted.ns < least.ns ? least : wanted;
}

static void choose_outputs(struct cycle *cy, uint8_t *image)
{
	const struct slave_set *live = cycle_outputs_live(cy);
	unsigned timed_out = outputs_choose(&cy->outputs, image, live, cy->sample.cycle);
	int is_live = live == &cy->live && cy->has_live;
	int is_fail_safe = !is_live || timed_out > 0 || cycle_is_control_safe(cy);

	if (is_fail_safe && !cy->was_fail_safe) {
		cycle_note(cy, EVENT_OUTPUT_FAIL_SAFE, 0, (int64_t)timed_out, 0);
	}
	cy->was_fail_safe = is_fail_safe;
	SET(cy->spec.stats->is_fail_safe, (uint32_t)is_fail_safe);
}

/* A set is answered as effective when a frame came back with it, from slaves that use it. */
static void answer_boards(struct cycle *cy, const struct exchange_result *res)
{
	struct slave_set arrived;

	if (!outputs_are_due(&cy->outputs) || !cycle_has_inputs(cy, res)) {
		return;
	}
	arrived = cy->live;
	slave_set_and_not(&arrived, &res->slaves_low);
	outputs_arrived(&cy->outputs, &arrived, cy->sample.cycle);
}

static void count_page_faults(struct cycle *cy)
{
	struct rusage usage;

	if (cy->steps % FAULT_CHECK_CYCLES == 0 && getrusage(RUSAGE_THREAD, &usage) == 0) {
		long faults = usage.ru_minflt + usage.ru_majflt;

		if (cy->steps == 0) {
			cy->faults_at_start = faults;
		}
		SET(cy->spec.stats->page_faults, (uint64_t)(faults - cy->faults_at_start));
	}
}

static void give_ride(struct cycle *cy)
{
	struct exchange_window window = {
		.period = cy->period,
		.wire_needed = mono_add(cy->deadline,
					(span_t){ cy->period.ns * LINE_WINDOW_PERCENT / 100 }),
		.listen_until =
			mono_add(cy->deadline, (span_t){ cy->period.ns * RIDE_PERCENT / 100 }),
	};

	ADD(cy->spec.stats->rides, exchange_ride(cy->spec.exchange, &window));
}

void cycle_step(struct cycle *cy)
{
	const struct platform *pf = &cy->spec.platform;
	struct cycle_stats *st = cy->spec.stats;
	mono_t now = wake(cy);
	struct exchange_result res;
	int64_t correction_ns;
	struct cycle_place place;
	mono_t done;

	if (cy->was_fail_safe) {
		cy->sample.flags |= SAMPLE_FAIL_SAFE;
	}
	res = exchange_run(cy->spec.exchange, cy->image, receive_deadline(cy, now));
	cycle_count_frames(cy, &res);
	cycle_watch_slaves(cy, &res);
	correction_ns = cycle_follow(cy, &res);
	place = cycle_place(cy, &res);
	cycle_pass_edges(cy, place.passed_edges);
	move_deadline(cy, place.late_periods, 0);
	cycle_report_skipped(cy);
	if (!place.is_in_window && cycle_has_inputs(cy, &res)) {
		ADD(st->frames_late, 1);
		cy->sample.flags |= SAMPLE_LATE;
	}
	answer_boards(cy, &res);
	cycle_judge(cy, &res, place.is_in_window);

	cy->sample.dc_time_ns = numbering_dc_time(&cy->numbering, cy->sample.cycle);
	cy->sample.wkc = res.wkc;
	cy->sample.round_trip_ns = res.round_trip.ns < 0 ? -1 : (int32_t)res.round_trip.ns;
	cy->sample.dc_diff_ns = (int32_t)(res.dc_diff_ns > INT32_MAX ? INT32_MAX : res.dc_diff_ns);
	cycle_push_sample(cy);
	cycle_control(cy);
	choose_outputs(cy, cy->image);

	SET(st->cycle_number, cy->sample.cycle);
	SET(st->dc_time_ns, cy->sample.dc_time_ns);
	cy->numbering.next = cy->sample.cycle + 1;
	count_page_faults(cy);
	done = pf->now(pf->ctx);
	histogram_add(&st->work, mono_sub(done, now).ns);
	give_ride(cy);
	move_deadline(cy, 1, correction_ns);
	SET(cy->next_wake_ns, cy->deadline.ns);
	cy->steps++;
	cycle_count_down(cy);
}

mono_t cycle_next_wake(const struct cycle *cycle)
{
	return (mono_t){ atomic_load_explicit(&cycle->next_wake_ns, memory_order_relaxed) };
}

/* A stack page first touched in the cycle would be a page fault there. */
static void touch_stack(void)
{
	volatile uint8_t stack[STACK_BYTES];

	for (size_t i = 0; i < sizeof(stack); i += 1024) {
		stack[i] = 0;
	}
}

int cycle_run(struct cycle *cycle)
{
	struct control *control = cycle->spec.control;

	touch_stack();
	if (control != NULL) {
		control_enter(control);
	}
	while (!atomic_load_explicit(&cycle->stop, memory_order_relaxed)) {
		cycle_step(cycle);
	}
	if (control != NULL) {
		control_leave(control);
	}
	return cycle->result;
}
