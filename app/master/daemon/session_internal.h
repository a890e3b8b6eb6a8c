/* SPDX-License-Identifier: MIT */
/* What session.c, bring_up.c, take_down.c and watch.c share; private to them. */
#ifndef DAEMON_SESSION_INTERNAL_H
#define DAEMON_SESSION_INTERNAL_H

#include <stdatomic.h>

#include "admin/server.h"
#include "base/board.h"
#include "bus/bus.h"
#include "bus/exchange.h"
#include "control/program.h"
#include "daemon/event_queue.h"
#include "daemon/networks.h"
#include "daemon/run_dir.h"
#include "daemon/session.h"
#include "link/line.h"

/* All slaves lost for this long: their clocks may have been reset, restart from bring-up. */
#define SESSION_LOST_NS (5 * NS_PER_S)

struct session {
	struct session_spec spec;
	struct run_dir run;
	struct admin_server *admin;
	struct networks *networks;
	int poller;             /* of both */
	_Atomic int stop_asked; /* [any] */
	mono_t stop_by; /* 0: not stopping; else nothing on the wire is waited for any longer */
	_Atomic int clear_asked;  /* [service] set; [cycle] reset */
	_Atomic int reload_asked; /* [any] */
	struct event_queue events;
	struct capture *capture; /* of the frames; always there */
	struct ring *frames;     /* where to; NULL: nobody has asked for it yet */
	unsigned captures;       /* requests that are open */
	unsigned replies_waiting;
	/* while the bus is up */
	struct line *line;
	struct bus *bus;
	struct ring *samples;
	struct exchange *exchange;
	struct cycle *cycle;
	struct control *control; /* NULL: none is configured */
	struct esi_library *esi; /* of the newest scan; NULL: none */
	struct board board;
	enum config_target target;
	int is_held;                   /* up, but not led to OP or recovered: hold.c */
	int is_waiting;                /* held since the bring-up failed */
	int is_climbing;               /* in session_bring_up() */
	int is_serving;                /* in admin_server_service() */
	mono_t served;                 /* newest pass of the admin socket */
	mono_t operator_at;            /* newest request to the bus or a slave; 0: none */
	struct admin_pending *restart; /* that asked for a bring-up; NULL: nobody */
	struct admin_pending *sii;     /* that works on an EEPROM; NULL: none */
	int is_riding;                 /* the cycle owns the transport and the event ring */
	int is_link_up;
	uint64_t link_cycles; /* with link_lost: at the last look at the link */
	uint64_t link_lost;
	enum bus_state state;
	int is_partial; /* RECOVERING, and the cycle continues with the slaves that are in OP */
	mono_t next_watch;
	uint64_t silent_cycles;  /* in a row without a frame */
	uint64_t unchanged_seen; /* frames that came back unchanged before the silence */
	uint64_t cycles_seen;
	uint64_t lost_seen;
	mono_t lost_since; /* all slaves, from then on; 0: not so */
	uint64_t wkc_low_seen;
	int is_wkc_alarming;    /* low in bus.wkc_miss_limit cycles since the last look */
	uint64_t alerts_seen;   /* cycle_alerts() when the last look began */
	uint64_t doubled_seen;  /* with doubled_since: where the window began */
	uint64_t doubled_since; /* cycles */
	int has_reported_doubled;
	int has_notice; /* in the message, while all slaves are in OP */
};

/** @ev goes to the event ring, stamped with the time now. */
void session_emit(struct session *s, const struct event *ev);
/** For bus.h: session_emit(). */
void session_bus_event(void *ctx, const struct event *ev);
/** Begin the mailbox request of an admin request; @ctx is the session. */
void session_mailbox(void *ctx, struct admin_pending *pending);
/** State, page and event. */
void session_state_set(struct session *s, enum bus_state state);
/** What the bus is led to, from the next bring-up on. */
void session_target_set(struct session *s, enum config_target target);
void session_wait(struct session *s, span_t span);
mono_t session_now(const struct session *s);

/** The platform as the cycle sees it: before it sleeps, it collects what the service thread left
 * for it. */
struct platform session_cycle_platform(struct session *s);

/** For line_set_cancel(): on the way up, a stop request; on the way down, its time is over. */
int session_is_cancelled(void *ctx);
/** 0; -ECANCELED with @failure on a stop request. */
int session_cancelled(const struct session *s, struct failure *failure);
/** After one call of bus/bus.h that gave @r and @error: @late is what "not in time" means for it.
 */
int session_step(struct session *s, int r, enum exit_code late, const char *error,
		 struct failure *failure);
/** The cycle runs: lock, SYNC0, SAFE-OP, OP. */
int session_lead_to_op(struct session *s, struct failure *failure);

/** Stop the cycle and take the transport back; the result of cycle_run(). */
int session_cycle_end(struct session *s);

/** The cycle has ended without a stop request: release it and report why. */
int session_report_ended(struct session *s, struct failure *failure);
/** Detect the loss of all frames from the cycle's counters, also during service transfers. */
void session_listen(struct session *s);
/** Of @frames sent, @twice came back a second time: warn if that is nearly all of them. */
void session_judge_doubled(struct session *s, uint64_t frames, uint64_t twice);
/** Admin requests, also in the middle of a bring-up: then only those that need no bus. */
void session_serve_admin(struct session *s);

/** Link and speed on the page. */
void session_show_link(struct session *s);

/** The target below OP is reached: keep it. */
void session_hold(struct session *s);
/** After a bring-up that failed: keep what was reached if the session may wait. 1: it does. */
int session_hold_failed(struct session *s, const struct failure *failure);
/** The opposite: it is taken down, or led on. */
void session_release(struct session *s);
/** Supervise a held bus, one step; an enum session_result. */
int session_watch_held(struct session *s);
/** No frame comes back: the page does not show AL states that were true before. */
void session_forget_states(struct session *s);

/** ADMIN_RESCAN, ADMIN_STATE, and what session_esc_request() does. */
void session_bus_request(void *ctx, struct admin_pending *pending);
/** ADMIN_REGISTER_..., ADMIN_SII_..., ADMIN_DIAGNOSIS, ADMIN_ERRORS_RESET. */
void session_esc_request(struct session *s, struct admin_pending *pending);
/** ADMIN_CAPTURE; @ctx is the session. */
void session_capture(void *ctx, struct admin_pending *pending);
/** ADMIN_STARTUP. */
void session_startup_request(const struct session *s, struct admin_pending *pending);
/** ADMIN_DATAGRAMS. */
void session_list_datagrams(struct session *s, struct admin_pending *pending);
/** ADMIN_COMPARE. */
void session_compare_request(const struct session *s, struct admin_pending *pending);
/** ADMIN_CONFIG_RELOAD. */
void session_reload_request(struct session *s, struct admin_pending *pending);
/** What session_reload_ask() asked for. */
void session_reload_if_asked(struct session *s);
/** Before a bring-up, while nothing is up: the newest configuration that was read. */
void session_take_reloaded(struct session *s);
/** The bus goes: end the request that works on an EEPROM. */
void session_sii_end(struct session *s);
/** Answer whoever asked for the bring-up that has ended; @failure NULL: it succeeded. */
void session_restart_done(struct session *s, const struct failure *failure);

/** Supervise the bus, one step; an enum session_result. */
enum session_result session_watch(struct session *s);

#endif
