/* SPDX-License-Identifier: MIT */
#include "daemon/session.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <unistd.h>

#include "daemon/session_internal.h"
#include "esi/library.h"
#include "link/capture.h"

#define ZERO(field) atomic_store_explicit(&(field), 0, memory_order_relaxed)

/* --- events: the cycle thread is the ring's producer while it runs, else this one --- */

void session_emit(struct session *s, const struct event *ev)
{
	struct event stamped = *ev;
	const struct platform *pf = &s->spec.platform;

	stamped.mono_ns = pf->now(pf->ctx).ns;
	stamped.tai_ns = pf->tai_ns(pf->ctx);
	stamped.cycle =
		atomic_load_explicit(&s->run.page->cycle.cycle_number, memory_order_relaxed);
	if (s->is_riding) {
		event_queue_push(&s->events, &stamped);
	} else {
		ring_push(s->run.events, &stamped, sizeof(stamped), NULL, 0);
	}
}

void session_bus_event(void *ctx, const struct event *ev)
{
	session_emit(ctx, ev);
}

/* --- the cycle's platform --- */

static void clear_control(struct control_status *st)
{
	ZERO(st->calls);
	ZERO(st->overruns);
	ZERO(st->safe_cycles);
	ZERO(st->limited);
	ZERO(st->refused);
	histogram_clear(&st->time);
}

/* Counters and histograms, but not the state of the cycle. */
static void clear_stats(struct cycle_stats *st)
{
	ZERO(st->frames_sent);
	ZERO(st->frames_lost);
	ZERO(st->frames_late);
	ZERO(st->frames_doubled);
	ZERO(st->frames_foreign);
	ZERO(st->wkc_low);
	ZERO(st->overruns);
	ZERO(st->cycles_skipped);
	ZERO(st->samples_good);
	ZERO(st->samples_bad);
	ZERO(st->samples_bad_unexplained);
	ZERO(st->op_lost);
	ZERO(st->cycles_with_stranger);
	ZERO(st->rides);
	ZERO(st->dc_unlocks);
	ZERO(st->cycles_dc_diff_high);
	ZERO(st->dc_diff_max_ns);
	for (size_t i = 0; i < LIMIT_SLAVES; i++) {
		ZERO(st->slave_good[i]);
		ZERO(st->slave_bad[i]);
	}
	histogram_clear(&st->wake_latency);
	histogram_clear(&st->round_trip);
	histogram_clear(&st->phase);
	histogram_clear(&st->work);
}

static mono_t cycle_now(void *ctx)
{
	const struct session *s = ctx;

	return s->spec.platform.now(s->spec.platform.ctx);
}

static int64_t cycle_tai(void *ctx)
{
	const struct session *s = ctx;

	return s->spec.platform.tai_ns(s->spec.platform.ctx);
}

/* Context: cycle thread, between two cycles. */
static int cycle_sleep(void *ctx, mono_t deadline)
{
	struct session *s = ctx;

	event_queue_collect(&s->events, s->run.events);
	if (atomic_load_explicit(&s->clear_asked, memory_order_relaxed)) {
		atomic_store_explicit(&s->clear_asked, 0, memory_order_relaxed);
		clear_stats(&s->run.page->cycle);
		clear_control(&s->run.page->control);
	}
	return s->spec.platform.sleep_until(s->spec.platform.ctx, deadline);
}

struct platform session_cycle_platform(struct session *s)
{
	return (struct platform){
		.now = cycle_now,
		.tai_ns = cycle_tai,
		.sleep_until = cycle_sleep,
		.ctx = s,
	};
}

/* --- small things --- */

mono_t session_now(const struct session *s)
{
	return s->spec.platform.now(s->spec.platform.ctx);
}

void session_wait(struct session *s, span_t span)
{
	mono_t until = mono_add(session_now(s), span);

	do {
		s->spec.hooks.wait(s->spec.hooks.ctx, until);
		if (s->spec.hooks.alive != NULL) {
			s->spec.hooks.alive(s->spec.hooks.ctx);
		}
	} while (session_now(s).ns < until.ns && !session_is_stop_asked(s));
}

int session_is_cancelled(void *ctx)
{
	const struct session *s = ctx;

	return s->stop_by.ns != 0 ? session_now(s).ns >= s->stop_by.ns : session_is_stop_asked(s);
}

int session_cancelled(const struct session *s, struct failure *failure)
{
	return session_is_stop_asked(s)
		       ? failure_set(failure, EXIT_CODE_OK, -ECANCELED,
				     "bring-up: stop requested before OP was reached")
		       : 0;
}

int session_step(struct session *s, int r, enum exit_code late, const char *error,
		 struct failure *failure)
{
	if (s->spec.hooks.alive != NULL) {
		s->spec.hooks.alive(s->spec.hooks.ctx);
	}
	/* Whatever failed after a stop request failed because of it. */
	if (r >= 0 || session_is_stop_asked(s)) {
		return session_cancelled(s, failure);
	}
	return failure_set(failure, failure_code_of_bus(r, late), r, "%s", error);
}

void session_state_set(struct session *s, enum bus_state state)
{
	struct event ev = {
		.id = EVENT_BUS_STATE,
		.slave_pos = EVENT_NO_SLAVE,
		.arg = { (int32_t)s->state, (int32_t)state },
	};

	if (s->state == state) {
		return;
	}
	session_emit(s, &ev);
	if (state == BUS_STOPPED) {
		atomic_store_explicit(&s->run.page->bus_state_at_stop, s->state,
				      memory_order_relaxed);
	}
	s->state = state;
	atomic_store_explicit(&s->run.page->bus_state, state, memory_order_relaxed);
}

void session_target_set(struct session *s, enum config_target target)
{
	static const enum bus_state states[] = {
		[CONFIG_TARGET_INIT] = BUS_INIT,
		[CONFIG_TARGET_PREOP] = BUS_PREOP,
		[CONFIG_TARGET_SAFEOP] = BUS_SAFEOP,
		[CONFIG_TARGET_OP] = BUS_OP,
	};

	s->target = target;
	atomic_store_explicit(&s->run.page->bus_target, states[target], memory_order_relaxed);
}

void session_show_link(struct session *s)
{
	struct status_page *page = s->run.page;
	const struct session_hooks *hooks = &s->spec.hooks;
	int mbps = s->is_link_up && hooks->link_mbps != NULL ? hooks->link_mbps(hooks->ctx) : 0;

	atomic_store_explicit(&page->link, s->is_link_up ? STATUS_LINK_UP : STATUS_LINK_DOWN,
			      memory_order_relaxed);
	atomic_store_explicit(&page->link_mbps, (uint32_t)mbps, memory_order_relaxed);
}

void session_set_message(struct session *session, const char *text)
{
	run_dir_set_message(&session->run, text);
}

void session_degraded(struct session *session, enum event_rt which, int err)
{
	struct event ev = {
		.id = EVENT_RT_DEGRADED,
		.slave_pos = EVENT_NO_SLAVE,
		.arg = { (int32_t)which, err },
	};

	atomic_fetch_or_explicit(&session->run.page->rt_degraded, 1u << which,
				 memory_order_relaxed);
	session_emit(session, &ev);
}

void session_cpu_set(struct session *session, uint32_t cpu)
{
	atomic_store_explicit(&session->run.page->cycle_cpu, cpu, memory_order_relaxed);
}

void session_stop_ask(struct session *session)
{
	atomic_store_explicit(&session->stop_asked, 1, memory_order_relaxed);
}

int session_is_stop_asked(const struct session *session)
{
	return atomic_load_explicit(&session->stop_asked, memory_order_relaxed);
}

const struct status_page *session_page(const struct session *session)
{
	return session->run.page;
}

struct control *session_control(const struct session *session)
{
	return session->control;
}

const struct run_dir *session_run_dir(const struct session *session)
{
	return &session->run;
}

span_t session_unattended(const struct session *session)
{
	return session->operator_at.ns == 0 ? (span_t){ INT64_MAX }
					    : mono_sub(session_now(session), session->operator_at);
}

static int is_pressed(const struct session *s)
{
	return s->replies_waiting > 0 || networks_are_busy(s->networks) ||
	       (s->is_riding && bus_is_busy(s->bus));
}

void session_sleep(struct session *session, span_t idle)
{
	struct pollfd fd = { .fd = session->poller, .events = POLLIN };

	if (is_pressed(session)) {
		poll(NULL, 0, 1);
	} else if (poll(&fd, 1, (int)(idle.ns / NS_PER_MS)) == 0) {
		admin_server_note_silence(session->admin);
	}
}

mono_t session_next_cycle(const struct session *session)
{
	return session->is_riding ? cycle_next_wake(session->cycle) : (mono_t){ 0 };
}

/* --- life --- */

static int open_sockets(struct session *s, char *error, size_t error_bytes)
{
	char admin[CONFIG_PATH_BYTES + 16];
	char remote[CONFIG_PATH_BYTES + 16];
	int r = run_dir_path(&s->run, CONFIG_RUN_ADMIN, admin, sizeof(admin));

	r = r < 0 ? r : run_dir_path(&s->run, CONFIG_RUN_COMMANDS_REMOTE, remote, sizeof(remote));
	if (r < 0) {
		snprintf(error, error_bytes, "%s: %s", s->run.dir, strerror(-r));
		return r;
	}
	r = admin_server_create(admin, s->run.admin_group, &s->admin, error, error_bytes);
	return r < 0 ? r
		     : admin_server_offer_board(s->admin, remote, s->run.remote_group,
						s->run.remote_fd, error, error_bytes);
}

static int watch_sockets(struct session *s, struct failure *failure)
{
	const int fds[] = { admin_server_fd(s->admin), networks_fd(s->networks) };

	s->poller = epoll_create1(EPOLL_CLOEXEC);
	for (size_t i = 0; i < sizeof(fds) / sizeof(fds[0]); i++) {
		struct epoll_event interest = { .events = EPOLLIN };

		if (s->poller < 0 || epoll_ctl(s->poller, EPOLL_CTL_ADD, fds[i], &interest) < 0) {
			return failure_set(failure, EXIT_CODE_RESOURCES, -errno, "epoll: %s",
					   strerror(errno));
		}
	}
	return 0;
}

static int open_networks(struct session *s, struct failure *failure)
{
	int r = networks_open(s->spec.cfg, &s->networks, failure);

	return r < 0 ? r : watch_sockets(s, failure);
}

int session_create(const struct session_spec *spec, struct session **ret_session,
		   struct failure *failure)
{
	struct session *s = aligned_alloc(64, (sizeof(*s) + 63) / 64 * 64);
	char error[FAILURE_TEXT_BYTES];
	int r;

	if (s == NULL) {
		return failure_set(failure, EXIT_CODE_RESOURCES, -ENOMEM, "session: no memory");
	}
	memset(s, 0, sizeof(*s));
	s->spec = *spec;
	s->poller = -1;
	r = capture_create(spec->platform, &s->capture);
	if (r < 0) {
		free(s);
		return failure_set(failure, EXIT_CODE_RESOURCES, r, "capture: no memory");
	}
	r = run_dir_open(&s->run, spec->cfg, &spec->platform, spec->segment, failure);
	if (r < 0) {
		session_destroy(s);
		return r;
	}
	session_target_set(s, spec->cfg->bus_target);
	r = open_sockets(s, error, sizeof(error));
	if (r < 0) {
		session_destroy(s);
		return failure_set(failure,
				   r == -EACCES || r == -EPERM ? EXIT_CODE_PERMISSION
							       : EXIT_CODE_CONFIG,
				   r, "%s", error);
	}
	r = open_networks(s, failure);
	if (r < 0) {
		session_destroy(s);
		return r;
	}
	*ret_session = s;
	return 0;
}

void session_conclude(struct session *session, const struct failure *failure)
{
	struct event ev = {
		.id = EVENT_STOPPED,
		.slave_pos = EVENT_NO_SLAVE,
		.value = (int64_t)atomic_load_explicit(&session->run.page->cycle.cycles,
						       memory_order_relaxed),
	};

	atomic_store_explicit(&session->run.page->exit_code,
			      failure != NULL ? (uint32_t)failure->code : EXIT_CODE_OK,
			      memory_order_relaxed);
	session_set_message(session, failure != NULL ? failure->text : "");
	session_state_set(session, failure != NULL ? BUS_FAILED : BUS_STOPPED);
	session_emit(session, &ev);
}

void session_stuck(struct session *session, enum exit_code code, const char *text)
{
	struct status_page *page = session->run.page;

	atomic_store_explicit(&page->control.state, CONTROL_STUCK, memory_order_relaxed);
	atomic_store_explicit(&page->exit_code, (uint32_t)code, memory_order_relaxed);
	session_set_message(session, text);
	atomic_store_explicit(&page->bus_state, BUS_FAILED, memory_order_release);
}

void session_destroy(struct session *session)
{
	if (session == NULL) {
		return;
	}
	session_drop(session);
	networks_close(session->networks);
	admin_server_destroy(session->admin);
	if (session->poller >= 0) {
		close(session->poller);
	}
	ring_destroy(session->frames);
	capture_destroy(session->capture);
	run_dir_close(&session->run);
	esi_library_free(session->esi);
	free(session);
}
