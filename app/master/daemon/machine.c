/* SPDX-License-Identifier: MIT */
#include "daemon/machine.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "control/program.h"
#include "link/port_use.h"

/* How long it sleeps while the cycle works for it: a frame of its own rides once a cycle. */
#define WAIT_NS (150 * NS_PER_US)
/* While the cycle sleeps: a stop request is looked at as often. */
#define WAIT_LONGEST_NS (10 * NS_PER_MS)

mono_t machine_now(void)
{
	struct platform pf = platform_posix();

	return pf.now(pf.ctx);
}

static enum packet_wait packet_wait(const struct config *cfg)
{
	switch (cfg->cycle_poll) {
	case CONFIG_POLL_SPIN:
		return PACKET_WAIT_SPIN;
	case CONFIG_POLL_SLEEP:
		return PACKET_WAIT_SLEEP;
	case CONFIG_POLL_AUTO:
		break;
	}
	return realtime_is_isolated(cfg->cycle_cpu) ? PACKET_WAIT_SPIN : PACKET_WAIT_SLEEP;
}

static enum exit_code code_of_transport(int r)
{
	switch (-r) {
	case EPERM:
	case EACCES:
		return EXIT_CODE_PERMISSION;
	case ENOMEM:
	case ENOBUFS:
		return EXIT_CODE_RESOURCES;
	default:
		return EXIT_CODE_INTERFACE;
	}
}

/* EtherCAT's frames do not go into a network of the machine unless somebody asks for it. */
static int check_port(const struct program *pg, struct failure *failure)
{
	const char *interface = pg->cfg.interface;
	char reason[PORT_USE_BYTES];
	int r = pg->options.is_forced ? 0 : port_use(interface, reason, sizeof(reason));

	if (r < 0) {
		return failure_set(failure, EXIT_CODE_INTERFACE, r,
				   "interface %s: cannot read its addresses: %s", interface,
				   strerror(-r));
	}
	if (r > 0) {
		return failure_set(
			failure, EXIT_CODE_BUSY, -EBUSY,
			"interface %s: %s, so it is not the EtherCAT port: choose another, "
			"take IP off this one (ip address flush dev %s), or give --force",
			interface, reason, interface);
	}
	return 0;
}

static int open_transport(void *ctx, struct transport *ret_transport, struct failure *failure)
{
	struct program *pg = ctx;
	char error[PACKET_ERROR_BYTES] = "";
	int r = check_port(pg, failure);

	if (r < 0) {
		return r;
	}
	r = packet_socket_open(pg->cfg.interface, packet_wait(&pg->cfg), ret_transport, error,
			       sizeof(error));
	if (r < 0) {
		return failure_set(failure, code_of_transport(r), r, "%s", error);
	}
	if (error[0] != '\0' && strcmp(error, pg->link_warning) != 0) {
		fprintf(stderr, "ecdaqd: warning: %s\n", error);
		snprintf(pg->link_warning, sizeof(pg->link_warning), "%s", error);
	}
	return 0;
}

/*
 * The cycle thread hangs, and nothing can be sent without it: end the process; the slaves'
 * watchdogs set the outputs safe. No lock, no exit handler: the program may hold any.
 */
static void end_stuck(void *ctx, int64_t busy_ns)
{
	struct program *pg = ctx;
	char text[FAILURE_TEXT_BYTES];
	char line[FAILURE_TEXT_BYTES + 16];
	int len;

	snprintf(text, sizeof(text),
		 "control: %.63s: cycle() has not returned for %" PRId64
		 " ms (control.stuck); the slaves' watchdogs make the outputs safe",
		 control_name(session_control(pg->session)), busy_ns / NS_PER_MS);
	session_stuck(pg->session, EXIT_CODE_CONTROL, text);
	len = snprintf(line, sizeof(line), "ecdaqd: %s\n", text);
	if (write(STDERR_FILENO, line, (size_t)len) < 0) {
		_exit(EXIT_CODE_CONTROL); /* its result is not read */
	}
	_exit(EXIT_CODE_CONTROL);
}

static int start_cycle(void *ctx, struct cycle *cycle, struct failure *failure)
{
	struct program *pg = ctx;
	int r = control_watchdog_start(&pg->control_watchdog,
				       &(struct control_watchdog_spec){
					       .control = session_control(pg->session),
					       .limit_ns = pg->cfg.control_stuck_ns,
					       .stuck = end_stuck,
					       .ctx = pg,
				       });

	if (r < 0) {
		return failure_set(failure, EXIT_CODE_RESOURCES, r, "control watchdog: %s",
				   strerror(-r));
	}
	r = realtime_cycle_start(&pg->realtime, cycle, failure);
	if (r < 0) {
		control_watchdog_stop(&pg->control_watchdog);
		return r;
	}
	if (pg->realtime.is_pinned) {
		session_cpu_set(pg->session, (uint32_t)pg->cfg.cycle_cpu);
	}
	return 0;
}

static int end_cycle(void *ctx)
{
	struct program *pg = ctx;
	int r = realtime_cycle_end(&pg->realtime);

	control_watchdog_stop(&pg->control_watchdog);
	return r;
}

static int has_cycle_ended(void *ctx)
{
	struct program *pg = ctx;

	return realtime_cycle_has_ended(&pg->realtime);
}

static void wait_shortly(void *ctx, mono_t until)
{
	const struct program *pg = ctx;
	struct platform pf = platform_posix();
	mono_t soon = mono_add(pf.now(pf.ctx), (span_t){ WAIT_NS });
	mono_t longest = mono_add(pf.now(pf.ctx), (span_t){ WAIT_LONGEST_NS });
	mono_t next = session_next_cycle(pg->session);

	/* While the cycle sleeps nothing comes, nor does it right behind its wake. */
	if (next.ns > soon.ns) {
		soon = mono_add(next, (span_t){ WAIT_NS });
		soon = soon.ns < longest.ns ? soon : longest;
	}
	pf.sleep_until(pf.ctx, soon.ns < until.ns ? soon : until);
}

static int link_mbps(void *ctx)
{
	const struct program *pg = ctx;
	char path[64 + sizeof(pg->cfg.interface)];
	char text[16] = "";
	long mbps;
	FILE *file;

	snprintf(path, sizeof(path), "/sys/class/net/%s/speed", pg->cfg.interface);
	file = fopen(path, "re");
	if (file == NULL) {
		return 0;
	}
	mbps = fgets(text, sizeof(text), file) != NULL ? strtol(text, NULL, 10) : 0;
	fclose(file);
	return mbps > 0 ? (int)mbps : 0;
}

static void alive(void *ctx)
{
	struct program *pg = ctx;

	notify_alive(&pg->notify, machine_now());
}

static void warn(void *ctx, const char *text)
{
	(void)ctx;
	fprintf(stderr, "ecdaqd: warning: %s\n", text);
}

static void note(void *ctx, const char *text)
{
	(void)ctx;
	printf("ecdaqd: %s\n", text);
	fflush(stdout);
}

static void degraded(void *ctx, enum event_rt which, int err, const char *text)
{
	struct program *pg = ctx;

	fprintf(stderr, "ecdaqd: warning: %s\n", text);
	session_degraded(pg->session, which, err);
}

static int32_t kernel_tai_offset(void)
{
	int32_t offset_s = 0;

	platform_tai_offset_s(&offset_s);
	return offset_s;
}

int machine_session_create(struct program *pg, struct failure *failure)
{
	struct session_spec spec = {
		.cfg = &pg->cfg,
		.reload = &pg->reload,
		.platform = platform_posix(),
		.hooks = {
			.transport_open = open_transport,
			.cycle_start = start_cycle,
			.cycle_end = end_cycle,
			.cycle_has_ended = has_cycle_ended,
			.wait = wait_shortly,
			.link_mbps = link_mbps,
			.alive = alive,
			.warn = warn,
			.note = note,
			.ctx = pg,
		},
		.segment = pg->options.is_simulated ? RUN_DIR_SIMULATED : RUN_DIR_REAL,
		.tai_offset_s = kernel_tai_offset(),
		.can_wait = 1,
	};

	return session_create(&spec, &pg->session, failure);
}

static void check_ring_place(struct program *pg)
{
	const struct run_dir *run = session_run_dir(pg->session);
	char text[CONFIG_PATH_BYTES + 128];

	if (!run->is_tmpfs) {
		snprintf(text, sizeof(text),
			 "%s: not on a tmpfs: write-back to the disk will delay the cycle "
			 "(runtime.run_dir)",
			 run->dir);
		degraded(pg, EVENT_RT_RING_DISK, 0, text);
	}
}

void machine_open(struct program *pg)
{
	realtime_open(&pg->realtime, &pg->cfg, degraded, pg);
	check_ring_place(pg);
}

void machine_close(struct program *pg)
{
	realtime_close(&pg->realtime);
}
