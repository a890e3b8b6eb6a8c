/* SPDX-License-Identifier: MIT */
/*
 * Readiness and signs of life to the service manager: datagrams to $NOTIFY_SOCKET, as sd_notify(3)
 * describes them. Without that variable nothing happens. Context: service thread.
 */
#ifndef DAEMON_NOTIFY_H
#define DAEMON_NOTIFY_H

#include <stddef.h>

#include "base/clock.h"

struct notify {
	int fd;              /* -1: no service manager */
	int64_t watchdog_ns; /* half of WATCHDOG_USEC; 0: none set */
	mono_t next_watchdog;
};

/** Reads the environment of this process. Close with notify_close(). */
void notify_open(struct notify *notify);
void notify_close(struct notify *notify);

/** Send one or more lines "READY=1", "STATUS=..."; never blocks, errors are ignored. */
void notify_send(const struct notify *notify, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

/** WATCHDOG=1 when it is due at @now. */
void notify_alive(struct notify *notify, mono_t now);

#endif
