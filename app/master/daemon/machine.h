/* SPDX-License-Identifier: MIT */
/* The session of ecdaqd on this machine: its NIC, its clock, its threads. Context: service thread.
 */
#ifndef DAEMON_MACHINE_H
#define DAEMON_MACHINE_H

#include "config/config.h"
#include "daemon/control_watchdog.h"
#include "daemon/notify.h"
#include "daemon/realtime.h"
#include "daemon/reload.h"
#include "daemon/session.h"
#include "link/packet_socket.h"

/* Command-line settings that are not in the configuration. */
struct options {
	uint64_t cycles;  /* stop after this many in OP; 0: no limit */
	uint64_t seconds; /* the same in seconds */
	int is_exiting;   /* where a bring-up fails, rather than wait */
	int is_simulated;
	int is_forced; /* the segment is on a port that carries IP */
};

struct program {
	struct options options;
	struct config cfg;
	struct reload reload; /* of cfg */
	struct notify notify;
	struct realtime realtime;
	struct control_watchdog control_watchdog;
	struct session *session;
	int interface_claim;
	int has_been_up;
	int is_ready;                          /* READY=1 was sent */
	char link_warning[PACKET_ERROR_BYTES]; /* last one printed */
	char waiting_text[FAILURE_TEXT_BYTES]; /* what it waits for, as printed; "": nothing */
	int can_retry;                         /* what it waits for may come by itself */
	mono_t retry_at;
	int64_t back_off_ns;    /* next time */
	uint64_t cycles_before; /* of earlier sessions, in OP */
	uint64_t cycles_at_op;
	mono_t op_since;
};

mono_t machine_now(void);
/** Makes pg->session on this machine's hooks. 0 or -errno with @failure. */
int machine_session_create(struct program *pg, struct failure *failure);
/** What the session needs of the machine; what cannot be had is reported once. */
void machine_open(struct program *pg);
void machine_close(struct program *pg);

#endif
