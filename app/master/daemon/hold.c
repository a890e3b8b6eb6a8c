/* SPDX-License-Identifier: MIT */
/*
 * A bus that is not in OP and is kept: bus.target is below OP, or a bring-up failed and the session
 * may wait. What was reached stays; the tool is served; outputs are safe. Nothing is recovered.
 */
#include <errno.h>
#include <string.h>

#include "daemon/session.h"
#include "daemon/session_internal.h"

void session_forget_states(struct session *s)
{
	for (size_t i = 0; i < LIMIT_SLAVES; i++) {
		struct slave_status *slave = &s->run.page->slave[i];

		atomic_store_explicit(&slave->al_state, 0, memory_order_relaxed);
		atomic_store_explicit(&slave->al_status_code, 0, memory_order_relaxed);
	}
}

/* A failure that a restart of ecdaqd, or a change of what it is given, does not have to come
 * before.
 */
static int can_hold(const struct session *s, const struct failure *failure)
{
	size_t slaves = 0;

	if (s->bus != NULL) {
		bus_slaves(s->bus, &slaves);
	}
	if (!s->spec.can_wait || failure->code == EXIT_CODE_OK ||
	    failure->code == EXIT_CODE_CONTROL || failure->code == EXIT_CODE_OVERRUN) {
		return 0;
	}
	return failure_is_transient(failure->code) || slaves > 0;
}

static void mark(struct session *s, int is_waiting)
{
	s->is_held = 1;
	s->is_waiting = is_waiting;
	atomic_store_explicit(&s->run.page->is_waiting, (uint32_t)is_waiting, memory_order_relaxed);
	s->next_watch = session_now(s);
	s->lost_since = (mono_t){ 0 };
}

/* The state that all have reached, for the page; the slaves stay as they are. */
static void keep(struct session *s)
{
	if (s->is_riding) {
		cycle_phase_set(s->cycle, CYCLE_SYNCED); /* outputs safe, no sample is judged */
	}
	if (s->state == BUS_SCANNING || s->state == BUS_DOWN) {
		session_state_set(s, BUS_INIT);
	}
}

void session_hold(struct session *s)
{
	keep(s);
	session_set_message(s, "");
	mark(s, 0);
}

int session_hold_failed(struct session *s, const struct failure *failure)
{
	size_t slaves = 0;

	if (!can_hold(s, failure)) {
		return 0;
	}
	if (s->bus != NULL) {
		bus_slaves(s->bus, &slaves);
	}
	if (slaves == 0) {
		session_drop(s); /* nothing to keep */
		session_state_set(s, BUS_DOWN);
	} else {
		keep(s);
	}
	session_set_message(s, failure->text);
	mark(s, 1);
	return 1;
}

int session_is_waiting(const struct session *session)
{
	return session->is_waiting;
}

int session_watch_held(struct session *s)
{
	struct bus_watch_report report = { 0 };
	unsigned count = atomic_load_explicit(&s->run.page->slave_count, memory_order_relaxed);

	if (s->bus == NULL) {
		return SESSION_GOES_ON;
	}
	if (bus_watch(s->bus, s->run.page, session_bus_event, s, &report) < 0) {
		session_forget_states(s);
		report.slaves_lost = count;
	}
	if (report.slaves_lost < count || count == 0) {
		s->lost_since = (mono_t){ 0 };
	} else if (s->lost_since.ns == 0) {
		s->lost_since = session_now(s);
	}
	return s->lost_since.ns != 0 && mono_sub(session_now(s), s->lost_since).ns > SESSION_LOST_NS
		       ? SESSION_LOST
		       : SESSION_GOES_ON;
}

void session_release(struct session *s)
{
	s->is_held = 0;
	s->is_waiting = 0;
	s->is_partial = 0;
	atomic_store_explicit(&s->run.page->is_waiting, 0, memory_order_relaxed);
}
