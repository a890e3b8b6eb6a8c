/* SPDX-License-Identifier: MIT */
/*
 * Requests to the admin socket: checked completely, then executed on a target,
 * which is the running session of ecdaqd (or a test's own). Nothing here knows sockets or threads.
 */
#ifndef ADMIN_COMMAND_H
#define ADMIN_COMMAND_H

#include <stddef.h>
#include <stdint.h>

#include "admin/pending.h"
#include "base/admin_protocol.h"
#include "base/board.h"
#include "base/clock.h"
#include "base/event.h"
#include "base/sample.h"
#include "config/config.h"

/* A one-shot time must be this many periods ahead: the next frames carry the value first. */
enum { ADMIN_ONESHOT_MARGIN_CYCLES = 5 };
/* From one message with data of a request to the next. */
#define ADMIN_DATA_TIMEOUT_NS (2 * NS_PER_S)
/* Latest time of a one-shot from now: a later one is probably a typing error. */
#define ADMIN_ONESHOT_AHEAD_NS (3600 * NS_PER_S)

/* What the commands work on. All of it belongs to the session; it may change between two requests.
 */
struct admin_target {
	const struct config *cfg;
	const struct channel *channels; /* NULL with channel_count 0: the bus is not mapped */
	size_t channel_count;
	const struct slave_info *slaves;
	size_t slave_count;
	struct board *board; /* of the local writer; NULL: the cycle does not run */
	int is_op;
	/** DC time now. 0 or -EAGAIN. */
	int (*dc_now)(void *ctx, int64_t *ret_dc_ns);
	/**
	 * Start a request to the mailbox of a slave that exists. It is completed at once or later,
	 * with reply.slave_code if the slave refused it. NULL while there is no bus.
	 */
	void (*mailbox)(void *ctx, struct admin_pending *pending);
	/** Start ADMIN_RESCAN, ADMIN_STATE of a slave that exists or of all, or a request to the
	 * registers or the EEPROM of a slave that exists. NULL while a bring-up is under way. */
	void (*bus_request)(void *ctx, struct admin_pending *pending);
	/** ADMIN_CAPTURE, also while there is no bus: it stays open until it is cancelled. */
	void (*capture)(void *ctx, struct admin_pending *pending);
	void (*stop)(void *ctx);
	void (*clear)(void *ctx);
	void (*emit)(void *ctx, const struct event *ev);
	void *ctx;
};

/**
 * Copy and check @message as it came from a client. 0; -EMSGSIZE wrong length, -EPROTO not a
 * request, -EINVAL a field out of range, each with one line in @why (ADMIN_TEXT_BYTES);
 * @ret_request is untouched then. Context: any.
 */
int admin_request_parse(const void *message, size_t len, struct admin_request *ret_request,
			char *why);

/**
 * Start an open request: it is complete afterwards, or will be. Context: service thread; never
 * waits itself.
 */
void admin_command_run(const struct admin_target *target, struct admin_pending *pending);

/**
 * Once for each request that was completed, before its answer goes out: events.
 */
void admin_command_report(const struct admin_target *target, struct admin_pending *pending);

/** 1 if each step of a request of @verb waits for a frame of its own: one of them in a pass. */
int admin_command_takes_frame(enum admin_verb verb);

#endif
