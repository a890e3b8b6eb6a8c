/* SPDX-License-Identifier: MIT */
/*
 * FoE (ETG.1000.6 part 5.8). Write: WRITE, acknowledge of packet 0, then a packet and its
 * acknowledge in turn; read: READ, then a packet and our acknowledge in turn. A packet that does
 * not fill the mail is the last. BUSY asks for the last mail once more; it is repeated after a
 * pause that grows from 10 to 200 ms, so that a slave that erases its flash is not kept busy with
 * answering.
 */
#include "mailbox/foe.h"

#include <errno.h>
#include <string.h>

#include "mailbox/mailbox.h"
#include "wire/foe.h"
#include "wire/sii.h"

#define PAUSE_FIRST_NS INT64_C(10000000)
#define PAUSE_LAST_NS INT64_C(200000000)
#define BUSY_LIMIT_NS INT64_C(60000000000)

static int is_write(const struct mailbox_request *rq)
{
	return rq->with.foe.operation == FOE_WRITE;
}

static void note_text(struct foe_state *st, const struct foe_message *m)
{
	size_t len = m->body_len < FOE_TEXT_BYTES - 1 ? m->body_len : FOE_TEXT_BYTES - 1;

	for (size_t i = 0; i < len; i++) {
		if (m->body[i] == '\0') {
			len = i;
			break;
		}
		st->text[i] = m->body[i] >= 0x20 && m->body[i] < 0x7f ? (char)m->body[i] : '_';
	}
	st->text[len] = '\0';
}

/* --- sending --- */

static int start(struct mailbox_request *rq)
{
	const struct foe_parameters *with = &rq->with.foe;
	size_t len = with->name != NULL ? strnlen(with->name, FOE_NAME_BYTES + 1) : 0;

	memset(&rq->state.foe, 0, sizeof(rq->state.foe));
	if ((with->operation != FOE_READ && with->operation != FOE_WRITE) || len == 0 ||
	    len > FOE_NAME_BYTES || len + FOE_HEADER_BYTES > rq->mail_capacity ||
	    rq->mail_room <= FOE_HEADER_BYTES || with->busy_limit.ns < 0) {
		return -EINVAL;
	}
	rq->total = is_write(rq) ? rq->capacity : 0;
	return MAILBOX_SEND;
}

static size_t compose_data(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	struct foe_state *st = &rq->state.foe;
	size_t left = rq->capacity - rq->len;
	size_t room = capacity - FOE_HEADER_BYTES;

	st->in_mail = left < room ? left : room;
	return foe_format(&(struct foe_message){ .operation = FOE_DATA,
						 .number = st->packet,
						 .body = rq->buffer + rq->len,
						 .body_len = st->in_mail },
			  data, capacity);
}

static int compose(struct mailbox_request *rq, uint8_t *data, size_t capacity)
{
	struct foe_state *st = &rq->state.foe;
	struct foe_message m = { .operation = FOE_ACK, .number = st->packet };

	switch (st->step) {
	case FOE_STEP_OPEN:
		st->is_begun = 1;
		m = (struct foe_message){ .operation = rq->with.foe.operation,
					  .number = rq->with.foe.password,
					  .body = (const uint8_t *)rq->with.foe.name,
					  .body_len = strlen(rq->with.foe.name) };
		break;
	case FOE_STEP_DATA:
		return (int)compose_data(rq, data, capacity);
	case FOE_STEP_ACK:
	case FOE_STEP_LAST_ACK:
		break;
	}
	return (int)foe_format(&m, data, capacity);
}

/* The acknowledge of the last packet is not answered. */
static int sent(struct mailbox_request *rq)
{
	return rq->state.foe.step == FOE_STEP_LAST_ACK ? MAILBOX_DONE : MAILBOX_WAIT;
}

/* --- receiving --- */

static void next_packet(struct mailbox_request *rq, enum foe_step step)
{
	struct foe_state *st = &rq->state.foe;

	rq->not_before = (mono_t){ 0 };
	st->step = step;
	st->packet++;
	st->is_busy = 0;
	st->busy_time = st->pause = (span_t){ 0 };
}

/* The same mail again, after a pause that counts from when it was sent. */
static int take_busy(struct mailbox_request *rq, const struct foe_message *m)
{
	struct foe_state *st = &rq->state.foe;
	int64_t limit_ns =
		rq->with.foe.busy_limit.ns > 0 ? rq->with.foe.busy_limit.ns : BUSY_LIMIT_NS;
	int64_t pause_ns = st->pause.ns > 0 ? 2 * st->pause.ns : PAUSE_FIRST_NS;

	if (st->step == FOE_STEP_OPEN) {
		pause_ns = PAUSE_LAST_NS; /* most slaves then open it without being asked again */
	}

	st->pause.ns = pause_ns < PAUSE_LAST_NS ? pause_ns : PAUSE_LAST_NS;
	st->is_busy = 1;
	st->busy_done = m->busy_done;
	st->busy_all = m->busy_all;
	note_text(st, m);
	st->busy_time.ns += st->pause.ns;
	if (st->busy_time.ns > limit_ns) {
		return -ETIMEDOUT;
	}
	rq->not_before = mono_add(rq->deadline, (span_t){ st->pause.ns - rq->timeout.ns });
	return MAILBOX_SEND;
}

/* An acknowledge of the packet before is one that came twice. */
static int take_ack(struct mailbox_request *rq, const struct foe_message *m)
{
	struct foe_state *st = &rq->state.foe;

	if (!is_write(rq) || m->number > st->packet) {
		return -EPROTO;
	}
	if (m->number < st->packet) {
		return MAILBOX_WAIT;
	}
	if (st->step == FOE_STEP_OPEN) {
		next_packet(rq, FOE_STEP_DATA);
		return MAILBOX_SEND;
	}
	rq->len += st->in_mail;
	if (st->in_mail < (size_t)rq->mail_capacity - FOE_HEADER_BYTES) {
		return MAILBOX_DONE;
	}
	next_packet(rq, FOE_STEP_DATA);
	return MAILBOX_SEND;
}

static int take_data(struct mailbox_request *rq, const struct foe_message *m)
{
	struct foe_state *st = &rq->state.foe;
	size_t room = (size_t)rq->mail_room - FOE_HEADER_BYTES;

	if (is_write(rq) || m->number > st->packet + 1 || m->body_len > room) {
		return -EPROTO;
	}
	if (m->number <= st->packet) {
		return MAILBOX_WAIT;
	}
	if (m->body_len > rq->capacity - rq->len) {
		return -EMSGSIZE;
	}
	if (m->body_len > 0) {
		memcpy(rq->buffer + rq->len, m->body, m->body_len);
	}
	rq->len += m->body_len;
	next_packet(rq, m->body_len < room ? FOE_STEP_LAST_ACK : FOE_STEP_ACK);
	return MAILBOX_SEND;
}

static int received(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	struct foe_message m;

	if (foe_parse(data, len, &m) < 0) {
		return -EPROTO;
	}
	if (!rq->state.foe.is_begun) {
		return MAILBOX_IGNORE; /* of a transfer before */
	}
	switch ((enum foe_operation)m.operation) {
	case FOE_ERROR:
		note_text(&rq->state.foe, &m);
		rq->detail = m.number;
		rq->state.foe.is_begun = 0;
		return -EREMOTEIO;
	case FOE_BUSY:
		return take_busy(rq, &m);
	case FOE_ACK:
		return take_ack(rq, &m);
	case FOE_DATA:
		return take_data(rq, &m);
	case FOE_READ:
	case FOE_WRITE:
		break;
	}
	return -EPROTO;
}

/* The slave closes the file, and keeps what it had. */
static int give_up(struct mailbox_request *rq, int error, uint8_t *data, size_t capacity)
{
	static const char text[] = "cancelled";

	if (!rq->state.foe.is_begun || error == -EREMOTEIO) {
		return 0;
	}
	return (int)foe_format(&(struct foe_message){ .operation = FOE_ERROR,
						      .number = FOE_ERROR_NOT_DEFINED,
						      .body = (const uint8_t *)text,
						      .body_len = sizeof(text) - 1 },
			       data, capacity);
}

const struct mailbox_protocol foe_protocol = {
	.type = MAILBOX_TYPE_FOE,
	.sii_bit = SII_MAILBOX_FOE,
	.start = start,
	.compose = compose,
	.sent = sent,
	.received = received,
	.give_up = give_up,
};
