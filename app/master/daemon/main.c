/* SPDX-License-Identifier: MIT */
/* ecdaqd: one session on this machine's clock, threads and NIC, until a stop signal. */
#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/stop.h"
#include "daemon/machine.h"
#include "program/command_line.h"
#include "program/error.h"

/* How long the service loop sleeps when nothing presses. */
#define SERVICE_PERIOD_NS (20 * NS_PER_MS)
#define BACK_OFF_MIN_NS (250 * NS_PER_MS)
#define BACK_OFF_MAX_NS (5 * NS_PER_S)
/* No retry while a client has worked with the bus for so long. */
#define UNATTENDED_NS (60 * NS_PER_S)

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

/* SIGHUP */
static void reload_session(int number)
{
	struct session *session = atomic_load(&signalled);

	(void)number;
	if (session != NULL) {
		session_reload_ask(session);
	}
}

/* --- start --- */

static void catch_signals(void)
{
	struct sigaction ignore = { .sa_handler = SIG_IGN };
	struct sigaction reload = { .sa_handler = reload_session, .sa_flags = SA_RESTART };

	stop_catch(STOP_GRACE_NS, stop_session);
	sigaction(SIGPIPE, &ignore, NULL);
	sigaction(SIGHUP, &reload, NULL);
}

/* --- the bus, again and again --- */

static void say_ready(struct program *pg)
{
	if (!pg->is_ready) {
		notify_send(&pg->notify, "READY=1");
		pg->is_ready = 1;
	}
}

/* The target is reached: OP, or what bus.target or a client says. */
static void begin(struct program *pg)
{
	const struct status_page *page = session_page(pg->session);
	unsigned slaves = atomic_load(&page->slave_count);
	const char *state = bus_state_to_str(atomic_load(&page->bus_state));
	int is_op = atomic_load(&page->bus_state) == BUS_OP;

	pg->waiting_text[0] = '\0';
	pg->back_off_ns = BACK_OFF_MIN_NS;
	pg->cycles_at_op = atomic_load(&page->cycle.cycles);
	if (is_op && !pg->has_been_up) {
		pg->op_since = machine_now();
	}
	pg->has_been_up |= is_op;
	printf("ecdaqd: %s: %u slave%s in %s, period %" PRId64 " us\n", pg->cfg.interface, slaves,
	       slaves == 1 ? "" : "s", state, pg->cfg.cycle_period_ns / NS_PER_US);
	fflush(stdout);
	say_ready(pg);
	notify_send(&pg->notify, "STATUS=%u slaves in %s", slaves, state);
}

/* The bring-up failed, and the session waits where it came to. */
static void begin_waiting(struct program *pg, const struct failure *failure)
{
	const char *state = bus_state_to_str(atomic_load(&session_page(pg->session)->bus_state));

	if (strcmp(pg->waiting_text, failure->text) != 0) {
		fprintf(stderr, "ecdaqd: waiting in %s: %s\n", state, failure->text);
		snprintf(pg->waiting_text, sizeof(pg->waiting_text), "%s", failure->text);
		pg->back_off_ns = BACK_OFF_MIN_NS;
	}
	say_ready(pg);
	notify_send(&pg->notify, "STATUS=waiting in %s: %s", state, failure->text);
	pg->can_retry = failure_is_transient(failure->code);
	pg->retry_at = mono_add(machine_now(), (span_t){ pg->back_off_ns });
	pg->back_off_ns =
		pg->back_off_ns * 2 > BACK_OFF_MAX_NS ? BACK_OFF_MAX_NS : pg->back_off_ns * 2;
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

/* A bus that somebody works with is not scanned under his hands. */
static int is_retry_due(const struct program *pg)
{
	return session_is_waiting(pg->session) && pg->can_retry &&
	       machine_now().ns >= pg->retry_at.ns &&
	       session_unattended(pg->session).ns >= UNATTENDED_NS;
}

/* Serve until the session ends or has to be brought up: an enum session_result, or -errno with
 * @failure. */
static int serve(struct program *pg, struct failure *failure)
{
	int r;

	do {
		session_sleep(pg->session, (span_t){ SERVICE_PERIOD_NS });
		r = session_service(pg->session, failure);
		if (r == SESSION_GOES_ON && pg->has_been_up && is_time_over(pg)) {
			r = SESSION_STOP_ASKED;
		}
		if (r == SESSION_GOES_ON && is_retry_due(pg)) {
			r = SESSION_RESTART;
		}
	} while (r == SESSION_GOES_ON);
	return r;
}

/* 0: the target is reached, or the session waits; else -errno with @failure. */
static int bring_up(struct program *pg, struct failure *failure)
{
	int r = session_bring_up(pg->session, failure);

	if (r == 0) {
		begin(pg);
		failure->code = EXIT_CODE_OK; /* whatever an earlier one failed with */
		return 0;
	}
	if (!session_is_waiting(pg->session) || session_is_stop_asked(pg->session)) {
		return r;
	}
	if (pg->options.is_exiting && !pg->has_been_up) {
		return r;
	}
	begin_waiting(pg, failure);
	failure->code = EXIT_CODE_OK;
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
		r = r < 0 ? r : serve(pg, failure);
		if (r == SESSION_LOST) {
			start_anew(pg);
		}
	} while (r == SESSION_LOST || r == SESSION_RESTART);
	notify_send(&pg->notify, "STOPPING=1");
	if (r < 0) {
		session_stop(pg->session, &stopping);
		return r;
	}
	if (session_is_waiting(pg->session)) {
		session_stop(pg->session, &stopping); /* it was not up: not a failed stop */
		return 0;
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

static int run(struct program *pg, const struct config_source *source)
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
	r = reload_init(&pg->reload, source, &pg->cfg, &failure);
	r = r < 0 ? r : machine_session_create(pg, &failure);
	if (r < 0) {
		reload_done(&pg->reload);
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
	reload_done(&pg->reload);
	if (pg->interface_claim >= 0) {
		close(pg->interface_claim);
	}
	notify_close(&pg->notify);
	return (int)failure.code;
}

static const char notes[] =
	"SIGHUP: the configuration is read again, as by ecdaq config reload.\n"
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
		{ "exit-on-failure", 0, args_flag, &op->is_exiting, NULL,
		  "exit if the bus does not reach its target, instead of waiting in the state that "
		  "was reached and serving ecdaq" },
		{ "force", 0, args_flag, &op->is_forced, NULL,
		  "use the interface even if it has an IP address or the default route" },
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
	return line.is_check ? (int)command_line_valid(&line) : run(&program, &line.source);
}
