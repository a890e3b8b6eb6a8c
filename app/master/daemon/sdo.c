/* SPDX-License-Identifier: MIT */
/* SDO transfers that the admin socket asks for: submitted, and answered when they have ended. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "bus/bus.h"
#include "daemon/session_internal.h"
#include "mailbox/mailbox.h"

enum { SDO_BYTES_MAX = 1 << 20 };

/* One transfer. Owned by its admin request until it has ended. */
struct transfer {
	struct mailbox_request request;
	struct bus *bus;
	struct admin_pending *pending;
	size_t shown; /* progress that the client knows */
	uint8_t buffer[];
};

static int is_read(const struct admin_pending *pending)
{
	return pending->request.verb == ADMIN_SDO_READ;
}

static const char *why(const struct mailbox_request *rq)
{
	if (rq->is_mailbox_error) {
		return mailbox_error_to_str(rq->detail);
	}
	switch (rq->result) {
	case -ETIMEDOUT:
		return "no answer";
	case -ECANCELED:
		return "cancelled";
	case -EMSGSIZE:
		return "object is longer than 1 MiB";
	case -EIO:
		return "the slave is lost";
	case -ENODEV:
		return "the slave was restarted";
	case -ENOTSUP:
		return "the slave has no CoE mailbox";
	case -EPROTO:
		return "its answer is malformed";
	default: /* any errno */
		return strerror(-rq->result);
	}
}

/* What was read goes to the client: in one message, or in many. */
static int answer(struct admin_pending *pending, const struct mailbox_request *rq)
{
	uint8_t *room = pending->reply.data;

	if (rq->len > ADMIN_DATA_BYTES) {
		room = admin_pending_reserve(pending, rq->len);
		if (room == NULL) {
			return -ENOMEM;
		}
		admin_pending_answer_len(pending, rq->len);
	} else {
		pending->reply.data_len = (uint32_t)rq->len;
	}
	memcpy(room, rq->buffer, rq->len);
	return 0;
}

static void end(struct admin_pending *pending, const struct mailbox_request *rq)
{
	const struct admin_request *asked = &pending->request;
	int r = rq->result;

	if (r == -EREMOTEIO && !rq->is_mailbox_error) {
		pending->reply.sdo_abort = rq->detail;
	}
	if (r == 0 && is_read(pending)) {
		r = answer(pending, rq);
	}
	if (r < 0 && pending->reply.sdo_abort == 0) {
		admin_pending_refuse(pending, r, "slave %u: SDO %s of 0x%04x:%02x: %s",
				     asked->slave_pos, is_read(pending) ? "read" : "write",
				     asked->index, asked->subindex, why(rq));
		return;
	}
	admin_pending_complete(pending, r);
}

static void transfer_done(void *ctx, struct mailbox_request *rq)
{
	struct transfer *tf = ctx;

	tf->pending->work = NULL;
	end(tf->pending, rq);
	free(tf);
}

static void poll_transfer(struct admin_pending *pending, const struct admin_target *target)
{
	struct transfer *tf = pending->work;

	(void)target;
	if (tf != NULL && tf->request.len != tf->shown && tf->request.total > ADMIN_DATA_BYTES) {
		tf->shown = tf->request.len;
		admin_pending_progress(pending, (uint32_t)tf->request.len,
				       (uint32_t)tf->request.total);
	}
}

static void cancel_transfer(struct admin_pending *pending)
{
	struct transfer *tf = pending->work;

	if (tf != NULL) {
		bus_sdo_cancel(tf->bus, &tf->request);
	}
}

void session_sdo(void *ctx, struct admin_pending *pending)
{
	const struct session *s = ctx;
	const struct admin_request *asked = &pending->request;
	size_t capacity = is_read(pending) ? SDO_BYTES_MAX : pending->data_len;
	struct transfer *tf = NULL;
	int r = -EMSGSIZE;

	if (capacity <= SDO_BYTES_MAX) {
		tf = calloc(1, sizeof(*tf) + capacity);
		r = tf != NULL ? 0 : -ENOMEM;
	}
	if (r < 0) {
		admin_pending_refuse(pending, r, "SDO of %zu bytes: %s", capacity,
				     r == -ENOMEM ? "no memory" : "1 MiB at most");
		return;
	}
	*tf = (struct transfer){
		.request = { .slave_pos = asked->slave_pos,
			     .with.coe = { .operation =
						   is_read(pending) ? COE_UPLOAD : COE_DOWNLOAD,
					   .index = asked->index,
					   .subindex = asked->subindex },
			     .capacity = capacity,
			     .done = transfer_done,
			     .ctx = tf },
		.bus = s->bus,
		.pending = pending,
	};
	tf->request.buffer = tf->buffer;
	if (!is_read(pending)) {
		memcpy(tf->buffer, pending->data, capacity);
	}
	pending->work = tf;
	pending->poll = poll_transfer;
	pending->cancel = cancel_transfer;
	r = bus_sdo_submit(s->bus, &tf->request);
	if (r < 0) {
		tf->request.result = r;
		transfer_done(tf, &tf->request);
	}
}
