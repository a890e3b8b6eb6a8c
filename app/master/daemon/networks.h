/* SPDX-License-Identifier: MIT */
/*
 * What connects the slaves' mailboxes with networks of the host: the mailbox gateway and the EoE
 * switch, each if it is configured. Private to the session. Context: service thread; only
 * networks_open() blocks.
 */
#ifndef DAEMON_NETWORKS_H
#define DAEMON_NETWORKS_H

#include "base/event.h"
#include "bus/bus.h"
#include "config/config.h"
#include "daemon/failure.h"

struct networks;

/** Sockets and TAP device. 0 or -errno with @failure. Free with networks_close(). */
int networks_open(const struct config *cfg, struct networks **ret_networks,
		  struct failure *failure);
void networks_close(struct networks *nets);

/** A descriptor that polls readable when there is something to do. */
int networks_fd(const struct networks *nets);
/** 1: networks_service() should be called again within a period or so. */
int networks_are_busy(const struct networks *nets);

/** One pass, before bus_step(). @bus NULL: it is not up. */
void networks_service(struct networks *nets, struct bus *bus, mono_t now);
/** The bus goes down, or away: nothing is at its mailbox engine any more. NULL is fine. */
void networks_detach(struct networks *nets);

/** Call until 0: 1 and @ret_event if something was lost, at most one of a kind in 10 s. */
int networks_report(struct networks *nets, mono_t now, struct event *ret_event);

#endif
