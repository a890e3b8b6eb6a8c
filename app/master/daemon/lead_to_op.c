/* SPDX-License-Identifier: MIT */
/* The last part of bring-up, while the cycle runs: lock, SYNC0, SAFE-OP, OP. */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "daemon/session.h"
#include "daemon/session_internal.h"

/* Consecutive cycles with a frame before OP is requested (T07). */
enum { FLOWING_CYCLES = 10 };
/* Consecutive reads of clocks that agree before SYNC0 is started (T23). */
enum { AGREEING_LOOKS = 20 };
#define LOOK_SPAN ((span_t){ 5 * NS_PER_MS })

static int look_again(struct session *s, mono_t give_up, struct failure *failure)
{
	int r = session_cancelled(s, failure);

	if (r < 0) {
		return r;
	}
	if (s->spec.hooks.cycle_has_ended(s->spec.hooks.ctx)) {
		return session_report_ended(s, failure);
	}
	if (session_now(s).ns >= give_up.ns) {
		return -ETIMEDOUT;
	}
	session_wait(s, LOOK_SPAN);
	return 0;
}

static uint64_t load(const _Atomic uint64_t *counter)
{
	return atomic_load_explicit(counter, memory_order_relaxed);
}

/* The newest |0x092C| of all slaves as the cycle reads it, an upper estimate; -1: not known. */
static int64_t newest_diff_ns(struct ring_reader *reader)
{
	struct sample_header header;

	/* What it has of slaves_bad is of no interest: with few slaves it is the image. */
	return ring_peek_newest(reader, &header, sizeof(header)) == RING_OK ? header.dc_diff_ns
									    : -1;
}

static int is_locked(const struct session *s)
{
	return atomic_load_explicit(&s->run.page->cycle.dc_state, memory_order_relaxed) ==
	       DC_LOCKED;
}

static int fail_unlocked(struct session *s, struct failure *failure)
{
	const struct cycle_stats *st = &s->run.page->cycle;

	return failure_set(failure, EXIT_CODE_CLOCKS, -ETIME,
			   "dc: no lock to the reference clock within %" PRId64
			   " ms (dc.lock_timeout): correction %" PRId64 " ppb, %" PRIu64
			   " of %" PRIu64 " frames lost, wake latency up to %" PRId64 " us",
			   s->spec.cfg->dc_lock_timeout_ns / NS_PER_MS,
			   atomic_load_explicit(&st->correction_ppb, memory_order_relaxed),
			   load(&st->frames_lost), load(&st->frames_sent),
			   histogram_max_magnitude(&st->wake_latency) / NS_PER_US);
}

static int fail_apart(const struct session *s, int64_t diff_ns, struct failure *failure)
{
	return failure_set(failure, EXIT_CODE_CLOCKS, -ETIME,
			   "dc: the slaves' clocks are up to %" PRId64
			   " ns off the reference (0x092C; dc.diff_limit is %" PRId64 " ns)",
			   diff_ns, s->spec.cfg->dc_diff_limit_ns);
}

/*
 * Until the servo is locked and the slaves' clocks have agreed in the newest AGREEING_LOOKS looks;
 * they do so meanwhile. Without @reader only the servo is waited for. dc.lock_timeout is for each.
 */
static int wait_for_both(struct session *s, struct ring_reader *reader, struct failure *failure)
{
	span_t timeout = { s->spec.cfg->dc_lock_timeout_ns };
	mono_t give_up = mono_add(session_now(s), timeout);
	int has_locked = 0;
	int looks = 0;

	for (;;) {
		int64_t diff_ns = reader != NULL ? newest_diff_ns(reader) : 0;
		int r;

		if (is_locked(s) && !has_locked) {
			has_locked = 1;
			give_up = mono_add(session_now(s), timeout);
		}
		looks = diff_ns >= 0 && diff_ns <= s->spec.cfg->dc_diff_limit_ns ? looks + 1 : 0;
		if (is_locked(s) && (reader == NULL || looks >= AGREEING_LOOKS)) {
			return 0;
		}
		r = look_again(s, give_up, failure);
		if (r == -ETIMEDOUT) {
			return is_locked(s) ? fail_apart(s, diff_ns, failure)
					    : fail_unlocked(s, failure);
		}
		if (r < 0) {
			return r;
		}
	}
}

/*
 * After the burst of static drift compensation, at one frame a cycle, the slaves' loops have to
 * settle again. Only bus.monitor sees that; without it the check during the burst is final.
 */
static int wait_for_clocks(struct session *s, struct failure *failure)
{
	struct ring_reader *reader = NULL;
	char path[CONFIG_PATH_BYTES + 16];
	int r;

	if (!bus_plan(s->bus)->monitor) {
		return wait_for_both(s, NULL, failure);
	}
	r = run_dir_path(&s->run, CONFIG_RUN_SAMPLES, path, sizeof(path));
	if (r == 0) {
		r = ring_reader_open(path, &reader);
	}
	if (r < 0) {
		return failure_set(failure, EXIT_CODE_RESOURCES, r, "%s: %s", path, strerror(-r));
	}
	r = wait_for_both(s, reader, failure);
	ring_reader_destroy(reader);
	return r;
}

/* The watchdog of a slave that goes to OP while frames are missing fires (T07). */
static int wait_for_flow(struct session *s, struct failure *failure)
{
	const struct cycle_stats *st = &s->run.page->cycle;
	mono_t give_up = mono_add(session_now(s), (span_t){ s->spec.cfg->bus_op_timeout_ns });
	uint64_t lost = load(&st->frames_lost);
	uint64_t enough = load(&st->cycles) + FLOWING_CYCLES;

	while (load(&st->cycles) < enough) {
		int r = look_again(s, give_up, failure);

		if (r == -ETIMEDOUT) {
			return failure_set(failure, EXIT_CODE_WIRE, -ETIME,
					   "bus: no steady exchange of frames: %" PRIu64
					   " of %" PRIu64 " lost",
					   load(&st->frames_lost), load(&st->frames_sent));
		}
		if (r < 0) {
			return r;
		}
		if (load(&st->frames_lost) != lost) {
			lost = load(&st->frames_lost);
			enough = load(&st->cycles) + FLOWING_CYCLES;
		}
	}
	return 0;
}

static int start_clocks(struct session *s, struct failure *failure)
{
	char error[BUS_ERROR_BYTES] = "";
	int64_t dc_now_ns = 0;
	int r;

	if (bus_plan(s->bus)->dc_reference == 0) {
		return 0;
	}
	r = wait_for_clocks(s, failure);
	if (r < 0) {
		return r;
	}
	r = cycle_dc_now(s->cycle, &dc_now_ns);
	if (r < 0) {
		return failure_set(failure, EXIT_CODE_CLOCKS, r, "dc: the DC time is not known");
	}
	return session_step(s, bus_sync0_start(s->bus, dc_now_ns, error), EXIT_CODE_CLOCKS, error,
			    failure);
}

int session_lead_to_op(struct session *s, struct failure *failure)
{
	span_t timeout = { s->spec.cfg->bus_op_timeout_ns };
	char error[BUS_ERROR_BYTES] = "";
	int r = start_clocks(s, failure);

	if (r < 0) {
		return r;
	}
	cycle_phase_set(s->cycle, CYCLE_SYNCED);
	r = wait_for_flow(s, failure);
	if (r < 0) {
		return r;
	}
	r = session_step(s, bus_request_state(s->bus, AL_SAFEOP, timeout, error), EXIT_CODE_STATE,
			 error, failure);
	if (r < 0) {
		return r;
	}
	session_state_set(s, BUS_SAFEOP);
	if (s->target == CONFIG_TARGET_SAFEOP) {
		return 0;
	}
	r = session_step(s, bus_startup(s->bus, CONFIG_TRANSITION_SO, error), EXIT_CODE_STATE,
			 error, failure);
	if (r < 0) {
		return r;
	}
	r = wait_for_flow(s, failure);
	if (r < 0) {
		return r;
	}
	return session_step(s, bus_request_state(s->bus, AL_OP, timeout, error), EXIT_CODE_STATE,
			    error, failure);
}
