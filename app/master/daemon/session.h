/* SPDX-License-Identifier: MIT */
/*
 * One run of the master, apart from threads: bring-up, service, stop. On the machine the hooks
 * start a thread for the cycle and wait by sleeping; on virtual time they step the cycle.
 * Everything here belongs to the service thread and may block; only session_stop_ask() may be
 * called from anywhere.
 *
 * A session may be brought up again after it was stopped, has failed or has lost its slaves: the
 * run directory, the status page, the event ring and the admin socket stay.
 */
#ifndef DAEMON_SESSION_H
#define DAEMON_SESSION_H

#include <stddef.h>
#include <stdint.h>

#include "base/event.h"
#include "base/platform.h"
#include "base/status.h"
#include "config/config.h"
#include "cycle/cycle.h"
#include "daemon/failure.h"
#include "daemon/run_dir.h"

struct reload;
struct session;

struct session_hooks {
	/** Open the way to the wire, once in each bring-up. 0 or -errno with @failure. */
	int (*transport_open)(void *ctx, struct transport *ret_transport, struct failure *failure);
	/** Start the thread of @cycle. 0 or -errno with @failure. */
	int (*cycle_start)(void *ctx, struct cycle *cycle, struct failure *failure);
	/** Stop it and wait for its end; the result of cycle_run(). */
	int (*cycle_end)(void *ctx);
	/** 1 if the cycle has ended without a stop request. */
	int (*cycle_has_ended)(void *ctx);
	/** Return at @until at the latest; on virtual time the cycle makes a step. */
	void (*wait)(void *ctx, mono_t until);
	/** Speed of the link in Mbit/s, 0: not known. May be NULL. */
	int (*link_mbps)(void *ctx);
	/** Called often, also in the middle of a long bring-up: a sign of life. May be NULL. */
	void (*alive)(void *ctx);
	/** A warning for whoever started the program; the session continues. May be NULL. */
	void (*warn)(void *ctx, const char *text);
	/** The same for what is no warning. May be NULL. */
	void (*note)(void *ctx, const char *text);
	void *ctx;
};

struct session_spec {
	const struct config *cfg; /* outlives the session */
	struct reload *reload;    /* the same, with this cfg; NULL: it is never read again */
	struct platform platform;
	struct session_hooks hooks;
	enum run_dir_segment segment;
	int32_t tai_offset_s; /* TAI - UTC of the kernel; 0: unset */
	int can_wait;         /* a bring-up that fails leaves the bus as far as it came */
};

/** Run directory, status page, event ring, admin socket. Free with session_destroy(). 0 or -errno.
 */
int session_create(const struct session_spec *spec, struct session **ret_session,
		   struct failure *failure);

/**
 * Scan, compare, map, clocks; then ring and cycle; the servo's lock, SYNC0, SAFE-OP, OP; as far as
 * the target (bus.target, or what a client asked for since). What is still up is taken down first.
 * 0, or -errno with @failure: then session_is_waiting(), or everything but the run directory is
 * taken down. -ECANCELED with EXIT_CODE_OK: stop requested on the way.
 */
int session_bring_up(struct session *session, struct failure *failure);
/** 1: the newest bring-up failed, and the session serves requests in the state that was reached. */
int session_is_waiting(const struct session *session);
/** Time since the newest request of a client to the bus or a slave; INT64_MAX: none. */
span_t session_unattended(const struct session *session);

enum session_result {
	SESSION_GOES_ON,
	SESSION_STOP_ASKED, /* by session_stop_ask() or the admin socket */
	SESSION_RESTART,    /* a client asked for it: bring it up again */
	SESSION_LOST, /* all slaves have been lost for long: take it down and bring it up again */
};

/**
 * One pass of the service loop: admin requests, bus watch, status page. An enum session_result, or
 * -errno with @failure if the cycle has ended without a stop request. May also be called while
 * nothing is up.
 */
int session_service(struct session *session, struct failure *failure);

/** Sleep until session_service() should be called again: when a socket has something to do, at once
 * if the session is pressed, else after @idle. */
void session_sleep(struct session *session, span_t idle);

/** When the cycle, which sleeps, does something next; in the past: it is at work, or there is none.
 * Context: service thread. */
mono_t session_next_cycle(const struct session *session);

/** Outputs safe, SAFE-OP, SYNC0 off, INIT, ring closed. Continues after errors: 0, or the first one
 * with @failure. */
int session_stop(struct session *session, struct failure *failure);
/** Release everything without sending a frame: the slaves are lost, or must keep their state. */
void session_drop(struct session *session);

/** How it all ended, for the status page: state STOPPED or FAILED, exit code, message. */
void session_conclude(struct session *session, const struct failure *failure);

/**
 * The cycle is stuck in the control program: state FAILED, @code and @text on the status page, and
 * nothing else. Context: any thread that ends the process right after.
 */
void session_stuck(struct session *session, enum exit_code code, const char *text);

/** Without a word on the wire. NULL is fine. */
void session_destroy(struct session *session);

/** Context: any, also a signal handler. */
void session_stop_ask(struct session *session);
int session_is_stop_asked(const struct session *session);
/** Read the configuration again, in the next session_service(). Context: any, also a signal
 * handler. */
void session_reload_ask(struct session *session);

/** A real-time setting could not be had: one bit and one event. Context: service thread. */
void session_degraded(struct session *session, enum event_rt which, int err);
/** The core of the cycle thread. Context: service thread. */
void session_cpu_set(struct session *session, uint32_t cpu);
/** A message for the status page; "" for none. Context: service thread. */
void session_set_message(struct session *session, const char *text);

/** The status page; it lives as long as the session. */
const struct status_page *session_page(const struct session *session);
struct control;
/** The control program; NULL: none. */
struct control *session_control(const struct session *session);
/** The run directory. */
const struct run_dir *session_run_dir(const struct session *session);

#endif
