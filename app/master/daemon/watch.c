/* SPDX-License-Identifier: MIT */
/* The service loop: a few times a second the bus, in every pass the admin socket. */
#include <errno.h>
#include <stdio.h>

#include "base/limits.h"
#include "base/slave_set.h"
#include "daemon/session.h"
#include "daemon/session_internal.h"

/* No frame back for this long: the cable at the master, or the first slave, is disconnected. */
#define SILENCE_NS (50 * NS_PER_MS)
#define WATCH_PERIOD_NS (100 * NS_PER_MS)
/* Recovery does one step per poll. */
#define RECOVERY_PERIOD_NS (20 * NS_PER_MS)
/* How often the admin socket is served while something else blocks. */
#define SERVE_PERIOD_NS (10 * NS_PER_MS)

enum { DOUBLED_WINDOW_CYCLES = 500, DOUBLED_FRAMES_MIN = 50 };

/* --- admin --- */

static int admin_dc_now(void *ctx, int64_t *ret_dc_ns)
{
	const struct session *s = ctx;

	return s->cycle != NULL ? cycle_dc_now(s->cycle, ret_dc_ns) : -EAGAIN;
}

static void admin_stop(void *ctx)
{
	session_stop_ask(ctx);
}

static void admin_clear(void *ctx)
{
	struct session *s = ctx;

	if (s->is_riding) {
		atomic_store_explicit(&s->clear_asked, 1, memory_order_relaxed);
		bus_clear_alarms(s->bus);
	}
}

static void make_target(struct session *s, struct admin_target *ret_target)
{
	*ret_target = (struct admin_target){
		.cfg = s->spec.cfg,
		.is_op = s->state == BUS_OP || s->is_partial,
		.dc_now = admin_dc_now,
		.capture = session_capture,
		.stop = admin_stop,
		.clear = admin_clear,
		.emit = session_bus_event,
		.ctx = s,
	};
	if (s->is_climbing) {
		return; /* the bus is in use: what needs it is refused */
	}
	ret_target->bus_request = session_bus_request;
	if (s->bus != NULL) {
		ret_target->slaves = bus_slaves(s->bus, &ret_target->slave_count);
		ret_target->mailbox = session_mailbox;
	}
	if (s->is_riding) {
		ret_target->cfg = bus_config(s->bus);
		ret_target->channels = bus_channels(s->bus, &ret_target->channel_count);
		ret_target->board = &s->board;
	}
}

void session_serve_admin(struct session *s)
{
	struct admin_target target;
	mono_t now = session_now(s);

	if (s->is_serving || (s->is_climbing && mono_sub(now, s->served).ns < SERVE_PERIOD_NS)) {
		return;
	}
	s->is_serving = 1;
	s->served = now;
	make_target(s, &target);
	s->replies_waiting = admin_server_service(s->admin, &target, now);
	s->is_serving = 0;
}

/* --- bus --- */

/* 1 if the cycle has had all its frames back since the last look: the link is up. */
static int do_frames_return(struct session *s)
{
	const struct cycle_stats *st = &s->run.page->cycle;
	uint64_t cycles = atomic_load_explicit(&st->cycles, memory_order_relaxed);
	uint64_t lost = atomic_load_explicit(&st->frames_lost, memory_order_relaxed);
	int do_return = s->is_riding && cycles > s->link_cycles && lost == s->link_lost;

	s->link_cycles = cycles;
	s->link_lost = lost;
	return do_return;
}

/* The query also binds the socket again to an interface that was removed and came back. Nobody is
 * asked where frames say the same. */
static void watch_link(struct session *s)
{
	const struct transport *tr = line_transport(s->line);
	int is_up = do_frames_return(s) && s->is_link_up ? 1 : tr->is_up(tr->ctx);
	struct event ev = {
		.id = EVENT_LINK,
		.slave_pos = EVENT_NO_SLAVE,
		.arg = { is_up, 0 },
	};

	if (is_up >= 0 && is_up != s->is_link_up) {
		s->is_link_up = is_up;
		session_emit(s, &ev);
		session_show_link(s);
	}
}

/* Others than the lost ones have data of their own, and their clocks still follow the reference. */
static int can_go_on(const struct session *s, const struct bus_watch_report *report)
{
	return s->spec.cfg->bus_datagrams == CONFIG_DATAGRAMS_PER_SLAVE && report->slaves_op > 0 &&
	       report->is_reference_op && (s->state == BUS_OP || s->state == BUS_RECOVERING);
}

/* The cycle continues with @slaves, but for those that frames have shown to have left OP since this
 * look began; none: outputs safe, no sample is judged. */
static void go_on_with(struct session *s, const struct slave_set *slaves)
{
	int is_none = slave_set_is_empty(slaves);

	if (!is_none) {
		/* Before the phase, which it is for. */
		cycle_slaves_set(s->cycle, slaves, s->alerts_seen);
	}
	cycle_phase_set(s->cycle, is_none ? CYCLE_SYNCED : CYCLE_OP);
}

/* What is to be known though all slaves are in OP: devices that are none of them, absent ones. */
static void follow_notice(struct session *s, const struct bus_watch_report *report)
{
	const char *text = report->trouble[0] != '\0' ? report->trouble : report->notice;

	if (text[0] != '\0' || s->has_notice) {
		session_set_message(s, text);
	}
	s->has_notice = text[0] != '\0';
}

static void follow_bus(struct session *s, const struct bus_watch_report *report)
{
	uint32_t count = atomic_load_explicit(&s->run.page->slave_count, memory_order_relaxed);
	struct slave_set live = slave_set_empty();
	char text[BUS_ERROR_BYTES];

	if (report->is_all_op && (s->state == BUS_RECOVERING || s->state == BUS_OP)) {
		live = slave_set_all(LIMIT_SLAVES);
		s->is_partial = 0;
		go_on_with(s, &live);
		if (s->state == BUS_RECOVERING) {
			session_state_set(s, BUS_OP);
			session_set_message(s, "");
		}
	} else if (!report->is_all_op) {
		if (can_go_on(s, report)) {
			live = report->in_op;
		}
		s->is_partial = !slave_set_is_empty(&live);
		go_on_with(s, &live);
		if (s->state == BUS_OP) {
			session_state_set(s, BUS_RECOVERING);
		}
		snprintf(text, sizeof(text), "bus: %u of %u slaves in OP, %u lost%s%s",
			 report->slaves_op, count, report->slaves_lost,
			 report->trouble[0] != '\0' ? ": " : "", report->trouble);
		session_set_message(s, text);
	}
	if (report->is_all_op && s->state == BUS_OP) {
		follow_notice(s, report);
	}
	if (report->slaves_lost < count) {
		s->lost_since = (mono_t){ 0 };
	} else if (s->lost_since.ns == 0) {
		s->lost_since = session_now(s);
	}
}

static uint64_t silence_limit(const struct session *s)
{
	return (uint64_t)(SILENCE_NS / s->spec.cfg->cycle_period_ns);
}

/* The cycle is the first to detect that no frame comes back. */
static void count_silence(struct session *s)
{
	const struct cycle_stats *st = &s->run.page->cycle;
	uint64_t cycles = atomic_load_explicit(&st->cycles, memory_order_relaxed);
	uint64_t lost = atomic_load_explicit(&st->frames_lost, memory_order_relaxed);

	if (lost < s->lost_seen || lost - s->lost_seen < cycles - s->cycles_seen) {
		s->silent_cycles = 0;
		s->unchanged_seen = line_unchanged(s->line);
	} else {
		s->silent_cycles += cycles - s->cycles_seen;
	}
	s->lost_seen = lost;
	s->cycles_seen = cycles;
}

static void follow_silence(struct session *s)
{
	struct bus_watch_report report = {
		.slaves_lost =
			atomic_load_explicit(&s->run.page->slave_count, memory_order_relaxed),
	};

	if (line_unchanged(s->line) > s->unchanged_seen) {
		snprintf(report.trouble, sizeof(report.trouble), "%s", LINE_UNCHANGED_TEXT);
	} else if (!s->is_link_up) {
		snprintf(report.trouble, sizeof(report.trouble), "interface %s has no link",
			 s->spec.cfg->interface);
	}
	session_forget_states(s);
	follow_bus(s, &report);
}

void session_listen(struct session *s)
{
	count_silence(s);
	if (s->state == BUS_OP && s->silent_cycles >= silence_limit(s)) {
		follow_silence(s);
	}
}

/* Its times have been rejected for long: only if it is still itself, the host's clock was wrong. */
static void follow_reference(struct session *s)
{
	if (exchange_doubts_reference(s->exchange) && bus_reference_is_itself(s->bus) == 1) {
		exchange_confirm_reference(s->exchange);
	}
}

/* All slaves are in OP, and yet process data do not come whole: the AL states say nothing of it. */
static void explain_low_wkc(struct session *s, struct bus_watch_report *report)
{
	char who[BUS_TROUBLE_BYTES - 64];

	if (!report->is_all_op || !s->is_wkc_alarming) {
		return;
	}
	bus_map_check(s->bus, who, sizeof(who));
	snprintf(report->trouble, sizeof(report->trouble),
		 "working counter low while all slaves are in OP%s%s", who[0] != '\0' ? ": " : "",
		 who);
}

enum session_result session_watch(struct session *s)
{
	struct bus_watch_report report = { 0 };

	s->alerts_seen = cycle_alerts(s->cycle);
	if (s->silent_cycles >= silence_limit(s)) {
		/* No slave answers; each request would cost its timeout. */
		follow_silence(s);
	} else if (bus_watch(s->bus, s->run.page, session_bus_event, s, &report) == 0) {
		explain_low_wkc(s, &report);
		follow_bus(s, &report);
		bus_lead_back(s->bus, session_bus_event, s);
		follow_reference(s);
	}
	if (s->lost_since.ns != 0 && mono_sub(session_now(s), s->lost_since).ns > SESSION_LOST_NS) {
		return SESSION_LOST;
	}
	return SESSION_GOES_ON;
}

void session_judge_doubled(struct session *s, uint64_t frames, uint64_t twice)
{
	static const char text[] = "duplicate frames: is a second ecdaq-sim or a switch on this "
				   "segment?";

	/* A flood of frames that are not ours is more than that. */
	int is_so = frames >= DOUBLED_FRAMES_MIN && twice >= frames - frames / 10 &&
		    twice <= frames + frames / 10;

	if (is_so && s->state != BUS_RECOVERING) {
		session_set_message(s, text);
	} else if (!is_so && s->has_reported_doubled && s->state == BUS_OP) {
		session_set_message(s, "");
	}
	if (is_so && !s->has_reported_doubled && s->spec.hooks.warn != NULL) {
		s->spec.hooks.warn(s->spec.hooks.ctx, text);
	}
	s->has_reported_doubled = is_so;
}

static void watch_doubled(struct session *s)
{
	const struct cycle_stats *st = &s->run.page->cycle;
	uint64_t cycles = atomic_load_explicit(&st->cycles, memory_order_relaxed);
	uint64_t doubled = atomic_load_explicit(&st->frames_doubled, memory_order_relaxed);
	uint64_t window = cycles - s->doubled_since;

	if (window < DOUBLED_WINDOW_CYCLES) {
		return;
	}
	if (doubled >= s->doubled_seen) { /* else cleared */
		session_judge_doubled(s, window, doubled - s->doubled_seen);
	}
	s->doubled_seen = doubled;
	s->doubled_since = cycles;
}

/* 1 once bus.wkc_miss_limit cycles had a low working counter: poll at once. */
static int is_wkc_alarming(struct session *s)
{
	uint64_t low = atomic_load_explicit(&s->run.page->cycle.wkc_low, memory_order_relaxed);
	uint64_t more = low - s->wkc_low_seen;

	if (low < s->wkc_low_seen) { /* cleared */
		s->wkc_low_seen = low;
		return 0;
	}
	return s->state == BUS_OP && more >= s->spec.cfg->bus_wkc_miss_limit_cycles;
}

int session_report_ended(struct session *s, struct failure *failure)
{
	int r = session_cycle_end(s);
	char text[FAILURE_TEXT_BYTES] = "";

	if (s->control != NULL) {
		control_describe_end(s->control, text, sizeof(text));
	}
	if (text[0] != '\0') {
		return failure_set(failure, EXIT_CODE_CONTROL, r < 0 ? r : -EIO, "%s", text);
	}
	if (r == -ETIME) {
		return failure_set(failure, EXIT_CODE_OVERRUN, r,
				   "cycle: overrun in cycle %llu, and cycle.overrun is stop",
				   (unsigned long long)atomic_load_explicit(
					   &s->run.page->cycle.cycle_number, memory_order_relaxed));
	}
	if (r == -ENOLCK) {
		return failure_set(failure, EXIT_CODE_OVERRUN, r,
				   "dc: lock lost in OP, and dc.unlock_policy is stop");
	}
	return failure_set(failure, EXIT_CODE_FAILED, r < 0 ? r : -EIO,
			   "cycle: thread ended unexpectedly: error %d", -r);
}

/* What is looked at a few times a second. */
static enum session_result watch(struct session *s)
{
	if (s->line != NULL) {
		watch_link(s);
	}
	if (s->is_held) {
		return (enum session_result)session_watch_held(s);
	}
	if (!s->is_riding) {
		return SESSION_GOES_ON;
	}
	watch_doubled(s);
	return session_watch(s);
}

static void serve_networks(struct session *s, mono_t now)
{
	struct event ev;

	networks_service(s->networks, s->bus, now);
	while (networks_report(s->networks, now, &ev)) {
		session_emit(s, &ev);
	}
}

int session_service(struct session *session, struct failure *failure)
{
	struct session *s = session;
	enum session_result news = SESSION_GOES_ON;
	mono_t now = session_now(s);

	if (s->spec.hooks.alive != NULL) {
		s->spec.hooks.alive(s->spec.hooks.ctx);
	}
	if (s->is_riding && s->spec.hooks.cycle_has_ended(s->spec.hooks.ctx)) {
		return session_report_ended(s, failure);
	}
	session_serve_admin(s);
	session_reload_if_asked(s);
	if (s->is_riding) {
		session_listen(s);
	}
	serve_networks(s, now);
	if (s->bus != NULL) {
		bus_step(s->bus, s->is_riding ? s->exchange : NULL);
	}
	s->is_wkc_alarming = is_wkc_alarming(s);
	if (now.ns >= s->next_watch.ns || s->is_wkc_alarming ||
	    (s->is_riding && cycle_alerts(s->cycle) != s->alerts_seen)) {
		s->wkc_low_seen =
			atomic_load_explicit(&s->run.page->cycle.wkc_low, memory_order_relaxed);
		atomic_fetch_add_explicit(&s->run.page->heartbeat, 1, memory_order_relaxed);
		news = watch(s);
		s->next_watch =
			mono_add(now, (span_t){ s->state == BUS_RECOVERING ? RECOVERY_PERIOD_NS
									   : WATCH_PERIOD_NS });
	}
	if (session_is_stop_asked(s)) {
		return SESSION_STOP_ASKED;
	}
	return s->restart != NULL ? SESSION_RESTART : (int)news;
}
