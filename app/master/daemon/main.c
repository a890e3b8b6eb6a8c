/* SPDX-License-Identifier: MIT */
/* ecdaqd: one session on this machine's clock, threads and NIC, until a stop signal. */
#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <unistd.h>

#include "base/stop.h"
#include "daemon/machine.h"
#include "program/command_line.h"
#include "program/error.h"

/* How long the service loop sleeps when nothing presses. */
#define SERVICE_PERIOD_MS 20
#define BACK_OFF_MIN_NS (250 * NS_PER_MS)
#define BACK_OFF_MAX_NS (5 * NS_PER_S)

/* An ordered stop takes less than a second; a second signal before that would cut it short. */
#define STOP_GRACE_NS (2 * NS_PER_S)

static struct session *_Atomic signalled;

static void stop_session(void)
{
	struct session *session = atomic_load(&signalled);

	if (session != NULL) {
		session_stop_ask(session);
	}
}

/* --- start --- */

static void catch_signals(void)
{
	struct sigaction ignore = { .sa_handler = SIG_IGN };

	stop_catch(STOP_GRACE_NS, stop_session);
	sigaction(SIGPIPE, &ignore, NULL);
	sigaction(SIGHUP, &ignore, NULL);
}

/* --- the bus, again and again --- */

static void say_ready(struct program *pg)
{
	if (!pg->is_ready) {
		notify_send(&pg->notify, "READY=1");
		pg->is_ready = 1;
	}
}

static void begin_op(struct program *pg)
{
	const struct status_page *page = session_page(pg->session);
	unsigned slaves = atomic_load(&page->slave_count);

	pg->waiting_for = EXIT_CODE_OK;
	pg->cycles_at_op = atomic_load(&page->cycle.cycles);
	if (!pg->has_been_up) {
		pg->op_since = machine_now();
	}
	pg->has_been_up = 1;
	printf("ecdaqd: %s: %u slave%s in OP, period %" PRId64 " us\n", pg->cfg.interface, slaves,
	       slaves == 1 ? "" : "s", pg->cfg.cycle_period_ns / NS_PER_US);
	fflush(stdout);
	say_ready(pg);
	notify_send(&pg->notify, "STATUS=%u slaves in OP", slaves);
}

static uint64_t cycles_in_op(const struct program *pg)
{
	return pg->cycles_before + atomic_load(&session_page(pg->session)->cycle.cycles) -
	       pg->cycles_at_op;
}

static int is_time_over(const struct program *pg)
{
	if (pg->options.cycles > 0 && cycles_in_op(pg) >= pg->options.cycles) {
		return 1;
	}
	return pg->options.seconds > 0 && (uint64_t)(mono_sub(machine_now(), pg->op_since).ns /
						     NS_PER_S) >= pg->options.seconds;
}

static void sleep_a_pass(const struct program *pg)
{
	struct pollfd fd = { .fd = session_fd(pg->session), .events = POLLIN };

	if (session_is_pressed(pg->session)) {
		poll(NULL, 0, 1);
	} else {
		poll(&fd, 1, SERVICE_PERIOD_MS);
	}
}

/* Serve in OP until the session ends: an enum session_result, or -errno with @failure. */
static int serve(struct program *pg, struct failure *failure)
{
	int r;

	do {
		sleep_a_pass(pg);
		r = session_service(pg->session, failure);
		if (r == SESSION_GOES_ON && is_time_over(pg)) {
			r = SESSION_STOP_ASKED;
		}
	} while (r == SESSION_GOES_ON);
	return r;
}

/* Link down: wait for @span_ns while serving the admin socket. Returns 1 on a stop request. */
static int idle(struct program *pg, int64_t span_ns)
{
	mono_t until = mono_add(machine_now(), (span_t){ span_ns });
	struct failure failure;

	while (machine_now().ns < until.ns) {
		sleep_a_pass(pg);
		if (session_service(pg->session, &failure) == SESSION_STOP_ASKED) {
			return 1;
		}
	}
	return 0;
}

/* 0 as soon as the bus is in OP; -errno with @failure when trying again makes no sense. */
static int bring_up(struct program *pg, struct failure *failure)
{
	int64_t back_off_ns = BACK_OFF_MIN_NS;
	int r;

	while ((r = session_bring_up(pg->session, failure)) < 0) {
		if (!failure_is_transient(failure->code) ||
		    !(pg->options.can_wait || pg->has_been_up)) {
			return r;
		}
		if (pg->waiting_for != failure->code) {
			fprintf(stderr, "ecdaqd: waiting: %s\n", failure->text);
			pg->waiting_for = failure->code;
		}
		say_ready(pg);
		notify_send(&pg->notify, "STATUS=waiting: %s", failure->text);
		if (idle(pg, back_off_ns)) {
			return failure_set(failure, EXIT_CODE_OK, -ECANCELED,
					   "bring-up: stopped before OP was reached");
		}
		back_off_ns = back_off_ns * 2 > BACK_OFF_MAX_NS ? BACK_OFF_MAX_NS : back_off_ns * 2;
	}
	begin_op(pg);
	return 0;
}

static void start_anew(struct program *pg)
{
	fprintf(stderr, "ecdaqd: %s: all slaves are lost; restarting when they are back\n",
		pg->cfg.interface);
	pg->cycles_before = cycles_in_op(pg);
	session_drop(pg->session);
}

static int run_bus(struct program *pg, struct failure *failure)
{
	struct failure stopping;
	int r;

	do {
		r = bring_up(pg, failure);
		if (r < 0) {
			return r;
		}
		r = serve(pg, failure);
		if (r == SESSION_LOST) {
			start_anew(pg);
		}
	} while (r == SESSION_LOST);
	notify_send(&pg->notify, "STOPPING=1");
	if (r < 0) {
		session_stop(pg->session, &stopping);
		return r;
	}
	return session_stop(pg->session, failure);
}

/* --- end --- */

static void summarize(const struct program *pg)
{
	const struct cycle_stats *st = &session_page(pg->session)->cycle;

	if (!pg->has_been_up) {
		return;
	}
	printf("ecdaqd: stopped after %" PRIu64 " cycles: %" PRIu64 " frames lost, %" PRIu64
	       " late, %" PRIu64 " overruns, %" PRIu64 " good and %" PRIu64
	       " bad samples, wake latency p50 %" PRId64 " us, p99.9 %" PRId64 " us, max %" PRId64
	       " us\n",
	       atomic_load(&st->cycles), atomic_load(&st->frames_lost),
	       atomic_load(&st->frames_late), atomic_load(&st->overruns),
	       atomic_load(&st->samples_good), atomic_load(&st->samples_bad),
	       histogram_percentile(&st->wake_latency, 500000) / NS_PER_US,
	       histogram_percentile(&st->wake_latency, 999000) / NS_PER_US,
	       histogram_max_magnitude(&st->wake_latency) / NS_PER_US);
}

static int fail(const struct failure *failure)
{
	error_print("ecdaqd", "%s", failure->text);
	return (int)failure->code;
}

static int run_session(struct program *pg, struct failure *failure)
{
	int r;

	/* A signal that arrived before the session was there. */
	if (stop_requested()) {
		session_stop_ask(pg->session);
	}
	machine_open(pg);
	r = run_bus(pg, failure);
	machine_close(pg);
	return r;
}

static int run(struct program *pg)
{
	struct failure failure = { .code = EXIT_CODE_OK };
	int r;

	if (pg->cfg.interface[0] == '\0') {
		failure_set(
			&failure, EXIT_CODE_CONFIG, -EINVAL,
			"bus.interface: not set: name the segment's NIC there or by --interface");
		return fail(&failure);
	}
	notify_open(&pg->notify);
	catch_signals();
	r = machine_session_create(pg, &failure);
	if (r < 0) {
		return fail(&failure);
	}
	atomic_store(&signalled, pg->session);
	pg->interface_claim = run_dir_claim_interface(pg->cfg.interface, &failure);
	r = pg->interface_claim < 0 ? pg->interface_claim : run_session(pg, &failure);
	if (r < 0) {
		fail(&failure);
	}
	session_conclude(pg->session, failure.code != EXIT_CODE_OK ? &failure : NULL);
	summarize(pg);
	atomic_store(&signalled, NULL);
	session_destroy(pg->session);
	if (pg->interface_claim >= 0) {
		close(pg->interface_claim);
	}
	notify_close(&pg->notify);
	return (int)failure.code;
}

static const char notes[] =
	"SIGTERM or SIGINT: outputs to fail-safe, slaves to INIT, within 1 s; a summary. Should "
	"that\n"
	"hang, another one 2 s later ends ecdaqd; then the slaves' watchdogs make the outputs "
	"safe.\n"
	"\n"
	"environment: ECDAQ_RUN_DIR (run directory where none is configured), NOTIFY_SOCKET and\n"
	"WATCHDOG_USEC (set by systemd for Type=notify)\n";

int main(int argc, char **argv)
{
	static struct program program;
	struct options *op = &program.options;
	const char *interface = NULL;
	const struct args_option options[] = {
		{ "interface", 0, args_text, &interface, "NIC",
		  "network interface of the segment (bus.interface)" },
		{ "cycles", 0, args_count, &op->cycles, "N", "stop after N cycles in OP" },
		{ "seconds", 0, args_count, &op->seconds, "N", "stop after N seconds in OP" },
		{ "wait", 0, args_flag, &op->can_wait, NULL,
		  "while there is no interface, link or slave yet: report it once and retry; "
		  "READY=1 is "
		  "sent when the waiting begins" },
		{ "simulated", 0, args_flag, &op->is_simulated, NULL,
		  "mark the segment as simulated in the status page" },
	};
	const struct command_line_override overrides[] = { { "bus.interface", &interface } };
	struct command_line line = {
		.program = "ecdaqd",
		.summary = "The EtherCAT master: finds the slaves on one network interface, brings "
			   "them to "
			   "OP and\n"
			   "exchanges process data in every cycle; samples go to a ring in the run "
			   "directory.\n",
		.options = options,
		.option_count = sizeof(options) / sizeof(options[0]),
		.overrides = overrides,
		.override_count = 1,
		.notes = notes,
		.exit_codes = (EXIT_CODE_BIT(CONTROL) << 1) - 1,
	};
	enum exit_code code;

	if (command_line_read(&line, argc, argv, &program.cfg, &code) == COMMAND_LINE_EXIT) {
		return (int)code;
	}
	return line.is_check ? (int)command_line_valid(&line) : run(&program);
}
