/* SPDX-License-Identifier: MIT */
#include "cycle/cycle.h"

#include <errno.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "base/event.h"
#include "cycle/check.h"
#include "cycle/dc_servo.h"
#include "cycle/numbering.h"
#include "cycle/outputs.h"

#define ADD(field, n)                                                                              \
	atomic_store_explicit(&(field), atomic_load_explicit(&(field), memory_order_relaxed) + (n), \
			      memory_order_relaxed)
#define SET(field, v) atomic_store_explicit(&(field), (v), memory_order_relaxed)

enum {
	STACK_BYTES = 64 * 1024,     /* touched before the first cycle */
	FAULT_CHECK_CYCLES = 64,     /* how often the thread's page faults are read */
	EVENT_WINDOW_CYCLES = 1000,  /* in so many cycles ... */
	EVENT_WINDOW_LIMIT = 20,     /* ... at most so many events of one kind */
	SETTLE_SHARE = 20,           /* slaves have a 20th of the period to put their inputs in place */
	RIDE_PERCENT = 85,           /* service frames until then */
};

struct event_gate {
	uint64_t window;
	unsigned count;
};

struct cycle {
	struct cycle_spec spec;
	span_t period;
	int64_t set_point_ns;
	mono_t deadline;
	mono_t start;
	struct dc_servo servo;
	struct numbering numbering;
	struct check check;
	struct outputs outputs;
	struct sample_header sample; /* of the cycle being made */
	uint8_t image[LIMIT_IMAGE_BYTES];
	enum cycle_phase phase;
	int has_started;
	int was_fail_safe;
	int is_latched_safe;         /* overrun policy fail_safe */
	unsigned lost_in_row;
	unsigned wkc_low_in_row;
	uint64_t steps;
	long faults_at_start;
	struct event_gate gate[EVENT_COUNT];
	int result;
	_Atomic int stop;            /* [any] */
	_Atomic int wanted_phase;    /* [service] */
	_Atomic uint64_t dc_sequence;/* [cycle] odd: the pair below is being written */
	_Atomic int64_t dc_ns;       /* [cycle] */
	_Atomic int64_t dc_mono_ns;  /* [cycle] */
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
	outputs_choose(&cy->outputs, cy->image, 0);
	*ret_cycle = cy;
	return 0;
}

void cycle_destroy(struct cycle *cycle)
{
	free(cycle);
}

void cycle_emit(struct cycle *cycle, struct event *ev)
{
	struct event_gate *gate = &cycle->gate[ev->id < EVENT_COUNT ? ev->id : 0];
	uint64_t window = cycle->steps / EVENT_WINDOW_CYCLES;

	/* A broken cable must not flood the ring; the counters have every one. */
	if (gate->window != window) {
		*gate = (struct event_gate){ .window = window, .count = 0 };
	}
	if (gate->count++ >= EVENT_WINDOW_LIMIT) {
		return;
	}
	ev->mono_ns = cycle->sample.wake_mono_ns;
	ev->tai_ns = cycle->sample.wake_tai_ns;
	ev->cycle = cycle->sample.cycle;
	ring_push(cycle->spec.events, ev, sizeof(*ev), NULL, 0);
}

static void emit(struct cycle *cy, enum event_id id, int64_t value, int64_t arg0, int64_t arg1)
{
	struct event ev = {
		.id = (uint16_t)id,
		.slave_pos = EVENT_NO_SLAVE,
		.value = value,
		.arg = { arg0 > INT32_MAX ? INT32_MAX : (int32_t)arg0,
			 arg1 > INT32_MAX ? INT32_MAX : (int32_t)arg1 },
	};

	cycle_emit(cy, &ev);
}

/* --- numbering: one sample for every SYNC0 edge --- */

static void push_sample(struct cycle *cy)
{
	ring_push(cy->spec.samples, &cy->sample, sizeof(cy->sample), cy->image,
		  cy->spec.plan->image_bytes);
}

/* The edges that passed while the master was late get a sample, too, with the last known inputs. */
static void skip_cycles(struct cycle *cy, uint64_t count)
{
	struct sample_header kept = cy->sample;
	uint64_t all = cy->spec.slave_count >= 64 ? UINT64_MAX
						  : (UINT64_C(1) << cy->spec.slave_count) - 1;

	if (count == 0) {
		return;
	}
	ADD(cy->spec.stats->overruns, 1);
	ADD(cy->spec.stats->cycles_skipped, count);
	emit(cy, EVENT_OVERRUN, (int64_t)kept.cycle, (int64_t)count, kept.wake_latency_ns);
	if (count > NUMBERING_SKIP_LIMIT) {
		emit(cy, EVENT_NUMBERING_JUMP, (int64_t)(kept.cycle + count), (int64_t)count, 0);
	} else {
		for (uint64_t i = 0; i < count; i++) {
			cy->sample.cycle = kept.cycle + i;
			cy->sample.dc_time_ns = numbering_dc_time(&cy->numbering, kept.cycle + i);
			cy->sample.frame_dc_ns = 0;
			cy->sample.round_trip_ns = -1;
			cy->sample.wkc = 0;
			cy->sample.slaves_bad = all;
			cy->sample.flags |= SAMPLE_SKIPPED;
			push_sample(cy);
		}
	}
	if (cy->phase == CYCLE_OP) {
		ADD(cy->spec.stats->samples_bad, count * cy->spec.slave_count);
		for (size_t i = 0; i < cy->spec.slave_count; i++) {
			ADD(cy->spec.stats->slave_bad[i], count);
		}
	}
	cy->sample = kept;
	cy->sample.cycle += count;
	cy->deadline = mono_add(cy->deadline, (span_t){ (int64_t)count * cy->period.ns });
	if (cy->spec.cfg->cycle_overrun == CONFIG_OVERRUN_FAIL_SAFE) {
		cy->is_latched_safe = 1;
	} else if (cy->spec.cfg->cycle_overrun == CONFIG_OVERRUN_STOP) {
		cy->result = -ETIME;
		cycle_stop(cy);
	}
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
		cy->is_latched_safe = 0;
	}
	cy->phase = wanted;
}

static mono_t wake(struct cycle *cy)
{
	const struct platform *pf = &cy->spec.platform;
	mono_t now;

	if (!cy->has_started) {
		cy->has_started = 1;
		cy->start = pf->now(pf->ctx);
		cy->deadline = mono_add(cy->start, cy->period);
	}
	pf->sleep_until(pf->ctx, cy->deadline);
	now = pf->now(pf->ctx);
	change_phase(cy);
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
	/* Later than the next SYNC0: the edges in between are lost to this master. */
	skip_cycles(cy, numbering_skipped(cy->period.ns, cy->set_point_ns,
					  mono_sub(now, cy->deadline).ns));
	return now;
}

/* --- exchange --- */

static mono_t receive_deadline(const struct cycle *cy, mono_t now)
{
	int64_t share_ns = (int64_t)((double)cy->period.ns *
				     cy->spec.cfg->cycle_receive_percent / 100.0);
	mono_t wanted = mono_add(now, (span_t){ share_ns });
	mono_t last = mono_add(cy->deadline, (span_t){ cy->period.ns * 9 / 10 });
	mono_t least = mono_add(now, (span_t){ cy->period.ns / 10 });

	if (wanted.ns > last.ns) {
		wanted = last;
	}
	return wanted.ns < least.ns ? least : wanted;
}

static void count_frames(struct cycle *cy, const struct exchange_result *res)
{
	struct cycle_stats *st = cy->spec.stats;

	ADD(st->cycles, 1);
	ADD(st->frames_sent, cy->spec.plan->chunk_count);
	if (res->status == EXCHANGE_NO_FRAME) {
		ADD(st->frames_lost, 1);
		cy->sample.flags |= SAMPLE_LOST;
		cy->lost_in_row++;
		/* Of a long row the first and then each power of two is enough. */
		if ((cy->lost_in_row & (cy->lost_in_row - 1)) == 0) {
			emit(cy, EVENT_FRAME_LOST, (int64_t)cy->sample.cycle, cy->lost_in_row, 0);
		}
	} else {
		cy->lost_in_row = 0;
		histogram_add(&st->round_trip, res->round_trip.ns);
	}
	if (res->late > 0) {
		ADD(st->frames_late, res->late);
		cy->sample.flags |= SAMPLE_LATE;
		emit(cy, EVENT_FRAME_LATE, (int64_t)cy->sample.cycle, res->late_by, 0);
	}
	if (res->doubled > 0) {
		ADD(st->frames_doubled, res->doubled);
		cy->sample.flags |= SAMPLE_DOUBLED;
		emit(cy, EVENT_FRAME_DOUBLED, (int64_t)cy->sample.cycle, 0, 0);
	}
	ADD(st->frames_foreign, res->foreign);
}

static void watch_wkc(struct cycle *cy, const struct exchange_result *res)
{
	if (res->status == EXCHANGE_WKC_LOW && cy->phase == CYCLE_OP) {
		ADD(cy->spec.stats->wkc_low, 1);
		cy->sample.flags |= SAMPLE_WKC_LOW;
		if (cy->wkc_low_in_row++ == 0) {
			emit(cy, EVENT_WKC_LOW, (int64_t)cy->sample.cycle, res->wkc,
			     res->wkc_expected);
		}
	} else if (res->status == EXCHANGE_OK && cy->wkc_low_in_row > 0) {
		emit(cy, EVENT_WKC_OK, (int64_t)cy->sample.cycle, res->wkc, cy->wkc_low_in_row);
		cy->wkc_low_in_row = 0;
	}
}

static void publish_dc(struct cycle *cy, int64_t dc_ns, int64_t mono_ns)
{
	uint64_t s = atomic_load_explicit(&cy->dc_sequence, memory_order_relaxed);

	atomic_store_explicit(&cy->dc_sequence, s + 1, memory_order_relaxed);
	atomic_thread_fence(memory_order_release);
	SET(cy->dc_ns, dc_ns);
	SET(cy->dc_mono_ns, mono_ns);
	atomic_store_explicit(&cy->dc_sequence, s + 2, memory_order_release);
}

int cycle_dc_now(const struct cycle *cycle, int64_t *ret_dc_ns)
{
	const struct platform *pf = &cycle->spec.platform;

	for (int tries = 0; tries < 1000; tries++) {
		uint64_t s = atomic_load_explicit(&cycle->dc_sequence, memory_order_acquire);
		int64_t dc_ns = atomic_load_explicit(&cycle->dc_ns, memory_order_relaxed);
		int64_t mono_ns = atomic_load_explicit(&cycle->dc_mono_ns, memory_order_relaxed);

		atomic_thread_fence(memory_order_acquire);
		if (s % 2 == 0 &&
		    atomic_load_explicit(&cycle->dc_sequence, memory_order_relaxed) == s) {
			if (s == 0) {
				return -EAGAIN;
			}
			*ret_dc_ns = dc_ns + pf->now(pf->ctx).ns - mono_ns;
			return 0;
		}
	}
	return -EAGAIN;
}

/* The servo's part: what the frame's DC time says about the next deadline. Returns the correction. */
static int64_t follow_reference(struct cycle *cy, const struct exchange_result *res)
{
	struct cycle_stats *st = cy->spec.stats;
	enum dc_state before = cy->servo.state;
	struct dc_servo_result servo;

	if (before == DC_OFF) {
		return 0;
	}
	if (res->status == EXCHANGE_NO_FRAME || res->dc_time_ns == 0) {
		servo = dc_servo_coast(&cy->servo);
	} else {
		servo = dc_servo_update(&cy->servo, res->dc_time_ns,
					mono_sub(res->sent, cy->deadline).ns);
		publish_dc(cy, res->dc_time_ns, res->sent.ns);
		cy->sample.frame_dc_ns = res->dc_time_ns;
		cy->sample.phase_error_ns = (int32_t)servo.error_ns;
	}
	if (cy->servo.state == DC_LOCKED) {
		if (before != DC_LOCKED) {
			emit(cy, EVENT_DC_LOCKED, (int64_t)cy->sample.cycle, servo.error_ns, 0);
		}
		if (st->dc_lock_ns == 0) {
			SET(st->dc_lock_ns,
			    mono_sub((mono_t){ cy->sample.wake_mono_ns }, cy->start).ns);
		}
		if (cy->sample.frame_dc_ns != 0) {
			histogram_add(&st->phase, servo.error_ns);
		}
		if (res->dc_diff_ns > st->dc_diff_max_ns) {
			SET(st->dc_diff_max_ns, res->dc_diff_ns);
		}
	} else {
		cy->sample.flags |= SAMPLE_DC_UNLOCKED;
		if (before == DC_LOCKED) {
			ADD(st->dc_unlocks, 1);
			emit(cy, EVENT_DC_UNLOCKED, (int64_t)cy->sample.cycle, servo.error_ns, 0);
		}
	}
	SET(st->dc_state, cy->servo.state);
	SET(st->correction_ppb,
	    (int64_t)(cy->servo.integral_ns * 1e9 / (double)cy->period.ns));
	return servo.correction_ns;
}

/*
 * Which SYNC0 edge the frame's inputs belong to, by the DC time at which it passed. 1 if it was in its
 * window; 0 if it passed while the slaves were still putting the edge's inputs in place.
 */
static int place_in_grid(struct cycle *cy, const struct exchange_result *res)
{
	struct numbering_place place;

	if (cy->phase == CYCLE_CLOCKS || res->dc_time_ns == 0 || cy->servo.state == DC_OFF) {
		return 1;
	}
	place = numbering_place(&cy->numbering, cy->sample.cycle, res->dc_time_ns);
	if (place.was_rebased) {
		emit(cy, EVENT_NUMBERING_JUMP, (int64_t)cy->sample.cycle, 0, 0);
		check_restart(&cy->check);
	}
	if (place.passed_edges > 0) {
		skip_cycles(cy, place.passed_edges);
	}
	return place.is_in_window;
}

/* --- judge and hand over --- */

static void count_bad(struct cycle *cy, uint64_t bad, int is_explained)
{
	struct cycle_stats *st = cy->spec.stats;
	uint64_t bad_count = 0;

	for (size_t i = 0; i < cy->spec.slave_count; i++) {
		if (bad >> i & 1) {
			bad_count++;
			ADD(st->slave_bad[i], 1);
		} else {
			ADD(st->slave_good[i], 1);
		}
	}
	ADD(st->samples_bad, bad_count);
	ADD(st->samples_good, cy->spec.slave_count - bad_count);
	if (!is_explained) {
		ADD(st->samples_bad_unexplained, bad_count);
	}
}

static void judge(struct cycle *cy, const struct exchange_result *res, int is_in_window)
{
	uint64_t all = cy->spec.slave_count >= 64 ? UINT64_MAX
						  : (UINT64_C(1) << cy->spec.slave_count) - 1;
	struct check_fault fault;

	if (cy->phase != CYCLE_OP) {
		cy->sample.flags |= SAMPLE_NOT_OP;
		cy->sample.slaves_bad = all;
		return;
	}
	if (res->status != EXCHANGE_OK || !is_in_window) {
		cy->sample.slaves_bad = all;
		count_bad(cy, all, res->status != EXCHANGE_WKC_LOW);
		return;
	}
	cy->sample.slaves_bad = check_image(&cy->check, cy->image, cy->sample.cycle, &fault);
	if (cy->sample.slaves_bad != 0) {
		struct event ev = { .id = EVENT_COUNTER_BAD,
				    .slave_pos = fault.slave_pos,
				    .value = (int64_t)cy->sample.cycle,
				    .arg = { (int32_t)fault.seen, (int32_t)fault.expected } };

		cy->sample.flags |= SAMPLE_BAD_COUNTER;
		cycle_emit(cy, &ev);
	}
	count_bad(cy, cy->sample.slaves_bad, 0);
}

static void choose_outputs(struct cycle *cy, uint8_t *image)
{
	int is_live = cy->phase == CYCLE_OP && !cy->is_latched_safe;
	unsigned timed_out = outputs_choose(&cy->outputs, image, is_live);
	int is_fail_safe = !is_live || timed_out > 0;

	if (is_fail_safe && !cy->was_fail_safe) {
		emit(cy, EVENT_OUTPUT_FAIL_SAFE, 0, (int64_t)timed_out, 0);
	}
	cy->was_fail_safe = is_fail_safe;
	SET(cy->spec.stats->is_fail_safe, (uint32_t)is_fail_safe);
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

void cycle_step(struct cycle *cy)
{
	const struct platform *pf = &cy->spec.platform;
	struct cycle_stats *st = cy->spec.stats;
	mono_t now = wake(cy);
	struct exchange_result res;
	int64_t correction_ns;
	int is_in_window;
	mono_t done;

	if (cy->was_fail_safe) {
		cy->sample.flags |= SAMPLE_FAIL_SAFE;
	}
	res = exchange_run(cy->spec.exchange, cy->image, receive_deadline(cy, now));
	count_frames(cy, &res);
	watch_wkc(cy, &res);
	correction_ns = follow_reference(cy, &res);
	is_in_window = place_in_grid(cy, &res);
	if (!is_in_window && res.status == EXCHANGE_OK) {
		ADD(st->frames_late, 1);
		cy->sample.flags |= SAMPLE_LATE;
	}
	outputs_sent(&cy->outputs, cy->sample.cycle);
	judge(cy, &res, is_in_window);

	cy->sample.dc_time_ns = numbering_dc_time(&cy->numbering, cy->sample.cycle);
	cy->sample.wkc = res.wkc;
	cy->sample.round_trip_ns = res.round_trip.ns < 0 ? -1 : (int32_t)res.round_trip.ns;
	cy->sample.dc_diff_ns = (int32_t)(res.dc_diff_ns > INT32_MAX ? INT32_MAX : res.dc_diff_ns);
	push_sample(cy);
	choose_outputs(cy, cy->image);

	SET(st->cycle_number, cy->sample.cycle);
	SET(st->dc_time_ns, cy->sample.dc_time_ns);
	cy->numbering.next = cy->sample.cycle + 1;
	count_page_faults(cy);
	done = pf->now(pf->ctx);
	histogram_add(&st->work, mono_sub(done, now).ns);
	if (exchange_ride(cy->spec.exchange,
			  mono_add(cy->deadline, (span_t){ cy->period.ns * RIDE_PERCENT / 100 }))) {
		ADD(st->rides, 1);
	}
	cy->deadline = mono_add(cy->deadline, (span_t){ cy->period.ns + correction_ns });
	cy->steps++;
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
	touch_stack();
	while (!atomic_load_explicit(&cycle->stop, memory_order_relaxed)) {
		cycle_step(cycle);
	}
	return cycle->result;
}

void cycle_stop(struct cycle *cycle)
{
	atomic_store_explicit(&cycle->stop, 1, memory_order_relaxed);
}

void cycle_phase_set(struct cycle *cycle, enum cycle_phase phase)
{
	atomic_store_explicit(&cycle->wanted_phase, (int)phase, memory_order_release);
}

int cycle_output_index(const struct cycle *cycle, size_t channel)
{
	for (size_t i = 0; i < cycle->outputs.output_count; i++) {
		if (cycle->outputs.output[i].channel == &cycle->spec.channels[channel]) {
			return (int)i;
		}
	}
	return -ENOENT;
}
