/* SPDX-License-Identifier: MIT */
/*
 * Requests to the admin socket: checked completely, then executed on a target,
 * which is the running session of ecdaqd (or a test's own). Nothing here knows sockets or threads.
 */
#ifndef ADMIN_COMMAND_H
#define ADMIN_COMMAND_H

#include <stddef.h>
#include <stdint.h>

#include "base/admin_protocol.h"
#include "base/board.h"
#include "base/clock.h"
#include "base/event.h"
#include "base/sample.h"
#include "config/config.h"

/* A one-shot time must be this many periods ahead: the next frames carry the value first. */
enum { ADMIN_ONESHOT_MARGIN_CYCLES = 5 };
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
	/** As bus_sdo_read() and bus_sdo_write(); NULL while there is no bus. */
	int (*sdo_read)(void *ctx, const struct admin_request *request, uint8_t *ret_data,
			size_t *len, uint32_t *ret_abort);
	int (*sdo_write)(void *ctx, const struct admin_request *request, uint32_t *ret_abort);
	void (*stop)(void *ctx);
	void (*clear)(void *ctx);
	void (*emit)(void *ctx, const struct event *ev);
	void *ctx;
};

enum admin_outcome {
	ADMIN_DONE,     /* the reply is complete */
	ADMIN_DEFERRED, /* complete as soon as the cycle has answered the board's set */
};

/**
 * Copy and check @message as it came from a client. 0; -EMSGSIZE wrong length, -EPROTO not a
 * request, -EINVAL a field out of range, each with one line in @why (ADMIN_TEXT_BYTES);
 * @ret_request is untouched then. Context: any.
 */
int admin_request_parse(const void *message, size_t len, struct admin_request *ret_request,
			char *why);

/**
 * Execute a parsed @request of user @uid. @reply is filled; with ADMIN_DEFERRED, the
 * board's set *ret_sequence must be on the wire before it is sent (admin_reply_finish()). Context:
 * service thread; SDO requests block.
 */
enum admin_outcome admin_command_run(const struct admin_target *target,
				     const struct admin_request *request, uint32_t uid,
				     struct admin_reply *reply, uint64_t *ret_sequence);

/** 1 and the cycle number in @reply once the cycle has put set @sequence on the wire; else 0. */
int admin_reply_finish(const struct board *board, uint64_t sequence, struct admin_reply *reply);

/** Make @reply the refusal @result with a line of text. */
void admin_reply_refuse(struct admin_reply *reply, int result, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

#endif
