/* SPDX-License-Identifier: MIT */
/* From OP, or from any step of bring-up, back to nothing. */
#include <errno.h>

#include "daemon/session.h"
#include "daemon/session_internal.h"

/* Number of cycles with fail-safe outputs before the slaves leave OP. */
enum { SAFE_CYCLES = 4 };
#define SAFE_TIMEOUT_NS (200 * NS_PER_MS)
/* From the beginning of a stop to the last frame, whatever is broken. */
#define STOP_NS (850 * NS_PER_MS)

int session_cycle_end(struct session *s)
{
	int r;

	if (!s->is_riding) {
		return 0;
	}
	r = s->spec.hooks.cycle_end(s->spec.hooks.ctx);
	s->is_riding = 0;
	line_ride_end(s->line);
	event_queue_collect(&s->events, s->run.events);
	return r;
}

static void make_outputs_safe(struct session *s)
{
	const _Atomic uint64_t *cycles = &s->run.page->cycle.cycles;
	uint64_t enough = atomic_load_explicit(cycles, memory_order_relaxed) + SAFE_CYCLES;
	mono_t give_up = mono_add(session_now(s), (span_t){ SAFE_TIMEOUT_NS });

	cycle_phase_set(s->cycle, CYCLE_SAFE);
	while (atomic_load_explicit(cycles, memory_order_relaxed) < enough &&
	       session_now(s).ns < give_up.ns &&
	       !s->spec.hooks.cycle_has_ended(s->spec.hooks.ctx)) {
		s->spec.hooks.wait(s->spec.hooks.ctx,
				   mono_add(session_now(s), (span_t){ NS_PER_MS }));
	}
}

/* Start-up SDOs of the way down. A failure is reported; the bus is stopped all the same.
 */
static void leave_op(struct session *s)
{
	char error[BUS_ERROR_BYTES] = "";

	if (!bus_has_startup(s->bus, CONFIG_TRANSITION_OS)) {
		return;
	}
	s->stop_by = mono_add(s->stop_by, (span_t){ BUS_STARTUP_DOWN_NS });
	if (bus_startup_down(s->bus, error) < 0 && s->spec.hooks.warn != NULL) {
		s->spec.hooks.warn(s->spec.hooks.ctx, error);
	}
}

int session_stop(struct session *session, struct failure *failure)
{
	struct session *s = session;
	char error[BUS_ERROR_BYTES];
	int first = 0;
	int r;

	if (s->bus == NULL) {
		session_drop(s);
		return 0;
	}
	s->stop_by = mono_add(session_now(s), (span_t){ STOP_NS });
	admin_server_cancel_all(s->admin);
	networks_detach(s->networks);
	if (s->is_riding) {
		make_outputs_safe(s);
		leave_op(s);
		r = bus_stop_outputs(s->bus, error);
		if (r < 0) {
			first = failure_set(failure, failure_code_of_bus(r, EXIT_CODE_STATE), r,
					    "%s", error);
		}
		session_cycle_end(s);
	}
	r = bus_stop(s->bus, error);
	if (r < 0 && first == 0) {
		first = failure_set(failure, failure_code_of_bus(r, EXIT_CODE_STATE), r, "%s",
				    error);
	}
	session_drop(s);
	return first;
}

void session_drop(struct session *session)
{
	struct session *s = session;

	if (s->run.page == NULL) {
		return; /* the run directory is another ecdaqd's: nothing was up */
	}
	session_release(s);
	session_forget_states(s);
	session_cycle_end(s);
	cycle_destroy(s->cycle);
	s->cycle = NULL;
	control_destroy(s->control);
	s->control = NULL;
	exchange_destroy(s->exchange);
	s->exchange = NULL;
	if (s->samples != NULL) {
		ring_close(s->samples);
		ring_destroy(s->samples);
		s->samples = NULL;
	}
	session_sii_end(s);
	networks_detach(s->networks);
	bus_destroy(s->bus);
	s->bus = NULL;
	if (s->line != NULL) {
		line_bind(NULL);
		line_destroy(s->line);
		s->line = NULL;
	}
}
