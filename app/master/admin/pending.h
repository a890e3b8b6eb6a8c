/* SPDX-License-Identifier: MIT */
/*
 * A request that may be answered later. The server makes one for each request that is executed and
 * owns it; whoever executes it fills reply, and completes it once: in the call that started it, or
 * in any later pass of the service loop.
 *
 * The client may disappear, cancel, or the timeout may pass before: then cancel() is called once,
 * and nobody reads the answer any more, but the pending request stays valid until it is completed.
 * So the executor may keep a pointer to it, and to its data, from start to completion. Context:
 * service thread.
 */
#ifndef ADMIN_PENDING_H
#define ADMIN_PENDING_H

#include <stddef.h>
#include <stdint.h>

#include "base/admin_protocol.h"
#include "base/clock.h"

struct admin_target;
struct client; /* of the server */

enum admin_pending_state {
	ADMIN_PENDING_FREE,
	ADMIN_PENDING_COLLECTING, /* its data are not complete */
	ADMIN_PENDING_QUEUED,     /* complete, and waiting for its turn on the bus */
	ADMIN_PENDING_OPEN,       /* executing */
	ADMIN_PENDING_COMPLETE,   /* its answer is being sent */
};

struct admin_pending {
	/* --- for the executor --- */
	struct admin_request request;
	const uint8_t *data; /* of the request; the whole of it */
	size_t data_len;
	uint32_t uid; /* of the client */
	int is_cancelled;
	int outlives_bus;         /* it works on nothing that goes with the bus */
	struct admin_reply reply; /* result, text, slave_code, cycle, dc_time_ns, data up to
				     ADMIN_DATA_BYTES; admin_pending_reserve() for more */
	/** Called in every pass until it is complete. NULL: none is needed. */
	void (*poll)(struct admin_pending *pending, const struct admin_target *target);
	/** Nobody waits any more: end it soon, and complete it. NULL: it is left to complete. */
	void (*cancel)(struct admin_pending *pending);
	/** Why it is not answered yet, for a client whose time is over; NULL: nothing to say. */
	const char *waits_for;
	void *work;        /* the executor's own */
	uint64_t sequence; /* the executor's own */
	/* --- the server's --- */
	enum admin_pending_state state;
	struct client *client; /* NULL: gone */
	mono_t give_up;
	uint8_t *upload;   /* NULL: data are in request.data */
	uint8_t *answer;   /* NULL: data are in reply.data */
	size_t answer_len; /* with answer */
	size_t sent;       /* bytes of the answer */
	int is_reported;
	int has_progress; /* to be sent */
};

/** The answer is ready: 0, or -errno with a line in reply.text (made up if it is empty). */
void admin_pending_complete(struct admin_pending *pending, int result);
/** The same with a line of text; @result is a negative errno. */
void admin_pending_refuse(struct admin_pending *pending, int result, const char *format, ...)
	__attribute__((format(printf, 3, 4)));
/** How far it is, for the client: @done of @total, 0 if that is not known. */
void admin_pending_progress(struct admin_pending *pending, uint32_t done, uint32_t total);
/** Room for @bytes of answer, up to ADMIN_TRANSFER_BYTES, in place of reply.data. NULL: no memory.
 */
uint8_t *admin_pending_reserve(struct admin_pending *pending, size_t bytes);
/** How much of the reserved room is the answer. */
void admin_pending_answer_len(struct admin_pending *pending, size_t bytes);

/* --- for the server --- */

/** Take @request of user @uid: OPEN, or COLLECTING if more data follow. 0 or -ENOMEM. */
int admin_pending_init(struct admin_pending *pending, const struct admin_request *request,
		       uint32_t uid);
/** The next data of a COLLECTING one; OPEN with the last. 0; -EINVAL: not the next ones. */
int admin_pending_collect(struct admin_pending *pending, const struct admin_request *more);
/** The next message of the answer of a COMPLETE one. */
void admin_pending_next(const struct admin_pending *pending, struct admin_reply *ret_message);
/** After that message was sent. 1: it was the last. */
int admin_pending_has_sent(struct admin_pending *pending, const struct admin_reply *message);
/** Back to FREE. */
void admin_pending_release(struct admin_pending *pending);

#endif
