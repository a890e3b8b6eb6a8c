/* SPDX-License-Identifier: MIT */
#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "mailbox/mailbox_internal.h"

#define NOT_BUSY_NS (100 * NS_PER_US)
#define FAREWELL_NS NS_PER_S

static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };

static mono_t now_of(const struct mailbox_engine *mb)
{
	return mb->wire.now(mb->wire.ctx);
}

static struct box_slave *slave_at(const struct mailbox_engine *mb, uint16_t pos)
{
	struct box_slave *sl = pos < mb->slave_end ? mb->slave[pos] : NULL;

	return sl != NULL && sl->is_present ? sl : NULL;
}

/* --- requests --- */

static void set_step(struct box_slave *sl, struct mailbox_request *rq, enum request_step step)
{
	sl->awaited -= rq->step == REQUEST_AWAIT;
	sl->awaited += step == REQUEST_AWAIT;
	rq->step = (uint8_t)step;
}

static void unlink_request(struct box_slave *sl, struct mailbox_request *rq)
{
	struct mailbox_request **at = &sl->queue;

	if (sl->active[rq->protocol->type] == rq) {
		sl->active[rq->protocol->type] = NULL;
		return;
	}
	while (*at != NULL && *at != rq) {
		at = &(*at)->next;
	}
	if (*at != NULL) {
		*at = rq->next;
	}
}

static void finish(struct mailbox_engine *mb, struct box_slave *sl, struct mailbox_request *rq,
		   int result)
{
	set_step(sl, rq, REQUEST_QUEUED);
	unlink_request(sl, rq);
	if (sl->writer.owner == rq) {
		sl->writer.owner = NULL;
		sl->writer.step = WRITER_IDLE; /* a mail that is not whole is written over */
	}
	sl->counters.timeouts += result == -ETIMEDOUT;
	mb->requests--;
	rq->next = NULL;
	rq->result = result;
	if (rq->done != NULL) {
		rq->done(rq->ctx, rq);
	}
}

/* End a request in the middle: its protocol may have a last word. */
static void give_up(struct mailbox_engine *mb, struct box_slave *sl, struct mailbox_request *rq,
		    int error)
{
	size_t capacity = sl->spec.out_bytes - (size_t)MAILBOX_HEADER_BYTES;

	if (rq->step != REQUEST_QUEUED && rq->protocol->give_up != NULL && sl->farewell_len == 0) {
		int len = rq->protocol->give_up(rq, error, sl->farewell,
						capacity < FAREWELL_BYTES ? capacity
									  : FAREWELL_BYTES);

		sl->farewell_len = len > 0 ? (size_t)len : 0;
		sl->farewell_type = (uint8_t)rq->protocol->type;
	}
	finish(mb, sl, rq, error);
}

static void follow(struct mailbox_engine *mb, struct box_slave *sl, struct mailbox_request *rq,
		   int next, mono_t now)
{
	switch (next) {
	case MAILBOX_DONE:
		finish(mb, sl, rq, 0);
		return;
	case MAILBOX_SEND:
		rq->deadline = mono_add(rq->not_before.ns > now.ns ? rq->not_before : now,
					rq->send_timeout.ns > 0 ? rq->send_timeout : rq->timeout);
		set_step(sl, rq, REQUEST_SEND);
		return;
	case MAILBOX_WAIT:
		rq->deadline = mono_add(now, rq->timeout);
		set_step(sl, rq, REQUEST_AWAIT);
		return;
	default:
		assert(next < 0);
		give_up(mb, sl, rq, next);
	}
}

static void activate(struct mailbox_engine *mb, struct box_slave *sl, mono_t now)
{
	struct mailbox_request *rq = sl->queue;

	while (rq != NULL) {
		struct mailbox_request *next = rq->next;
		enum mailbox_type type = rq->protocol->type;

		if (sl->active[type] == NULL) {
			unlink_request(sl, rq);
			rq->next = NULL;
			sl->active[type] = rq;
			follow(mb, sl, rq, rq->protocol->start(rq), now);
		}
		rq = next;
	}
}

static void expire(struct mailbox_engine *mb, struct box_slave *sl, mono_t now)
{
	for (unsigned type = 0; type < MAILBOX_TYPES; type++) {
		struct mailbox_request *rq = sl->active[type];

		if (rq != NULL && now.ns >= rq->deadline.ns) {
			give_up(mb, sl, rq, -ETIMEDOUT);
		}
	}
}

/* --- for box.c --- */

static void feed_farewell(struct mailbox_engine *mb, struct box_slave *sl, mono_t now)
{
	memcpy(sl->writer.mail + MAILBOX_HEADER_BYTES, sl->farewell, sl->farewell_len);
	sl->writer.owner = NULL;
	sl->writer.give_up = mono_add(now, (span_t){ FAREWELL_NS });
	box_post(mb, sl, sl->farewell_type, sl->farewell_len, now);
	sl->farewell_len = 0;
}

static int feed_request(struct mailbox_engine *mb, struct box_slave *sl, struct mailbox_request *rq,
			mono_t now)
{
	size_t capacity = sl->spec.out_bytes - (size_t)MAILBOX_HEADER_BYTES;
	int r = rq->protocol->compose(rq, sl->writer.mail + MAILBOX_HEADER_BYTES, capacity);

	if (r < 0) {
		give_up(mb, sl, rq, r);
		return 0;
	}
	assert((size_t)r <= capacity);
	sl->writer.owner = rq;
	set_step(sl, rq, REQUEST_SENDING);
	box_post(mb, sl, (uint8_t)rq->protocol->type, (size_t)r, now);
	return 1;
}

static void feed(struct mailbox_engine *mb, uint16_t pos, mono_t now)
{
	struct box_slave *sl = mb->slave[pos];

	if (sl->farewell_len > 0) {
		feed_farewell(mb, sl, now);
		return;
	}
	for (unsigned i = 0; i < MAILBOX_TYPES; i++) {
		unsigned type = (sl->next_type + i) % MAILBOX_TYPES;
		struct mailbox_request *rq = sl->active[type];

		if (rq != NULL && rq->step == REQUEST_SEND && now.ns >= rq->not_before.ns &&
		    feed_request(mb, sl, rq, now)) {
			sl->next_type = (type + 1) % MAILBOX_TYPES;
			return;
		}
	}
}

static void sent(struct mailbox_engine *mb, uint16_t pos, mono_t now)
{
	struct box_slave *sl = mb->slave[pos];
	struct mailbox_request *rq = sl->writer.owner;

	sl->counters.sent++;
	sl->writer.owner = NULL;
	if (rq != NULL) {
		follow(mb, sl, rq,
		       rq->protocol->sent != NULL ? rq->protocol->sent(rq) : MAILBOX_WAIT, now);
	}
}

/* The slave could not take a mail: it does not say which; the one that waits longest. */
static struct mailbox_request *find_refused(struct box_slave *sl)
{
	struct mailbox_request *oldest = NULL;

	for (unsigned type = 0; type < MAILBOX_TYPES; type++) {
		struct mailbox_request *rq = sl->active[type];

		if (rq != NULL && rq->step == REQUEST_AWAIT &&
		    (oldest == NULL || rq->deadline.ns < oldest->deadline.ns)) {
			oldest = rq;
		}
	}
	return oldest;
}

static void received(struct mailbox_engine *mb, uint16_t pos, const struct mailbox_header *header,
		     const uint8_t *data, mono_t now)
{
	struct box_slave *sl = mb->slave[pos];
	struct mailbox_request *rq = sl->active[header->type];
	const struct mailbox_sink *sink = &mb->sink[header->type];

	if (header->type == MAILBOX_TYPE_ERROR) {
		rq = find_refused(sl);
		if (rq != NULL) {
			rq->detail = mailbox_error_get(data, header->data_len);
			rq->is_mailbox_error = 1;
			finish(mb, sl, rq, -EREMOTEIO);
			return;
		}
	} else if (rq != NULL && rq->step == REQUEST_AWAIT) {
		int next = rq->protocol->received(rq, data, header->data_len);

		if (next != MAILBOX_IGNORE) {
			follow(mb, sl, rq, next, now);
			return;
		}
	}
	if (sink->take != NULL) {
		sink->take(sink->ctx, pos, data, header->data_len);
	} else {
		sl->counters.dropped++;
	}
}

static void gap(struct mailbox_engine *mb, uint16_t pos)
{
	struct box_slave *sl = mb->slave[pos];

	for (unsigned type = 0; type < MAILBOX_TYPES; type++) {
		struct mailbox_request *rq = sl->active[type];

		if (rq != NULL && rq->step == REQUEST_AWAIT) {
			rq->has_gap = 1;
		}
	}
}

static void malformed(struct mailbox_engine *mb, uint16_t pos, uint8_t type)
{
	struct box_slave *sl = mb->slave[pos];
	struct mailbox_request *rq = sl->active[type];

	if (rq != NULL && rq->step == REQUEST_AWAIT) {
		give_up(mb, sl, rq, -EPROTO);
	}
}

/* --- a pass --- */

static void land(struct mailbox_engine *mb, enum outcome outcome)
{
	size_t count = mb->flight_count;

	mb->flight_count = 0;
	for (size_t i = 0; i < count; i++) {
		box_result(mb, &mb->flight[i], outcome, NULL, now_of(mb));
	}
}

static void unpack(struct mailbox_engine *mb, size_t len)
{
	size_t count = mb->flight_count;
	struct ecat_datagram dg;
	size_t at = 0;
	size_t i = 0;

	mb->flight_count = 0;
	for (; i < count && ecat_frame_next(mb->answer, len, &at, &dg) == 1; i++) {
		const struct flight *fl = &mb->flight[i];
		enum outcome outcome = get_le16(dg.wkc) > 0 ? OUTCOME_DONE : OUTCOME_DENIED;

		box_result(mb, fl, dg.data_len == fl->len ? outcome : OUTCOME_LOST, dg.data,
			   now_of(mb));
	}
	for (; i < count; i++) {
		box_result(mb, &mb->flight[i], OUTCOME_LOST, NULL, now_of(mb));
	}
}

/* 1: the frame is still out. */
static int collect(struct mailbox_engine *mb)
{
	int r;

	if (mb->flight_count == 0) {
		return 0;
	}
	r = mb->wire.collect(mb->wire.ctx, mb->answer, sizeof(mb->answer));
	if (r == -EAGAIN) {
		return 1;
	}
	if (r >= 0) {
		unpack(mb, (size_t)r);
	} else {
		/* -ENOENT: the line began or ended to be ridden, the frame may have been sent. */
		land(mb, r == -ETIMEDOUT || r == -EMSGSIZE || r == -ENOENT ? OUTCOME_LOST
									   : OUTCOME_UNSENT);
	}
	return 0;
}

static void launch(struct mailbox_engine *mb, mono_t now)
{
	uint16_t start = mb->cursor < mb->slave_end ? mb->cursor : 0;

	mb->frame_limit = mb->wire.frame_limit(mb->wire.ctx);
	mb->sequence++;
	ecat_frame_begin(&mb->fb, mb->frame, source);
	for (uint16_t i = 0; i < mb->slave_end; i++) {
		uint16_t pos = (uint16_t)((start + i) % mb->slave_end);

		if (slave_at(mb, pos) != NULL && box_add(mb, pos, now)) {
			mb->cursor = pos;
			break;
		}
	}
	if (mb->flight_count > 0 &&
	    mb->wire.submit(mb->wire.ctx, mb->frame, ecat_frame_end(&mb->fb)) < 0) {
		land(mb, OUTCOME_UNSENT);
	}
}

void mailbox_step(struct mailbox_engine *mb)
{
	int is_out = collect(mb);
	mono_t now = now_of(mb);

	for (uint16_t pos = 0; pos < mb->slave_end; pos++) {
		struct box_slave *sl = slave_at(mb, pos);

		if (sl != NULL) {
			expire(mb, sl, now);
			activate(mb, sl, now);
		}
	}
	if (!is_out) {
		launch(mb, now);
	}
}

/* --- public --- */

int mailbox_create(const struct mailbox_wire *wire, struct mailbox_engine **ret_mb)
{
	struct mailbox_engine *mb = calloc(1, sizeof(*mb));

	if (mb == NULL) {
		return -ENOMEM;
	}
	mb->wire = *wire;
	mb->hooks = (struct box_hooks){
		.feed = feed, .sent = sent, .received = received, .gap = gap, .malformed = malformed
	};
	*ret_mb = mb;
	return 0;
}

static void end_active(struct mailbox_engine *mb, struct box_slave *sl, int error)
{
	for (unsigned type = 0; type < MAILBOX_TYPES; type++) {
		if (sl->active[type] != NULL) {
			finish(mb, sl, sl->active[type], error);
		}
	}
}

static void end_all(struct mailbox_engine *mb, struct box_slave *sl, int error)
{
	while (sl->queue != NULL) {
		finish(mb, sl, sl->queue, error);
	}
	end_active(mb, sl, error);
}

void mailbox_destroy(struct mailbox_engine *mb)
{
	if (mb == NULL) {
		return;
	}
	for (uint16_t pos = 0; pos < mb->slave_end; pos++) {
		if (mb->slave[pos] != NULL) {
			mb->slave[pos]->is_present = 0; /* done() cannot submit any more */
			end_all(mb, mb->slave[pos], -ECANCELED);
			free(mb->slave[pos]);
		}
	}
	free(mb);
}

static int is_box(uint16_t start, uint16_t bytes)
{
	return bytes >= MAILBOX_MIN_BYTES && bytes <= MAILBOX_BYTES &&
	       (uint32_t)start + bytes <= 0x10000;
}

int mailbox_slave_set(struct mailbox_engine *mb, uint16_t slave_pos,
		      const struct mailbox_slave_spec *spec)
{
	struct box_slave *sl;

	if (slave_pos >= LIMIT_SLAVES ||
	    (spec != NULL && (!is_box(spec->out_start, spec->out_bytes) ||
			      !is_box(spec->in_start, spec->in_bytes)))) {
		return -EINVAL;
	}
	sl = mb->slave[slave_pos];
	if (spec == NULL) {
		if (sl != NULL) {
			sl->is_present = 0;
			end_all(mb, sl, -ENODEV);
		}
		return 0;
	}
	if (sl == NULL) {
		sl = calloc(1, sizeof(*sl));
		if (sl == NULL) {
			return -ENOMEM;
		}
		mb->slave[slave_pos] = sl;
		mb->slave_end =
			slave_pos < mb->slave_end ? mb->slave_end : (uint16_t)(slave_pos + 1);
	}
	end_active(mb, sl, -ENODEV);
	sl->spec = *spec;
	sl->is_present = 1;
	box_reset(mb, sl, now_of(mb));
	return 0;
}

int mailbox_slave_has(const struct mailbox_engine *mb, uint16_t slave_pos, uint16_t sii_bit)
{
	const struct box_slave *sl = slave_at(mb, slave_pos);

	return sl != NULL && (sl->spec.protocols & sii_bit) != 0;
}

int mailbox_submit(struct mailbox_engine *mb, struct mailbox_request *rq)
{
	struct box_slave *sl = slave_at(mb, rq->slave_pos);
	struct mailbox_request **at;

	if (mailbox_is_running(rq)) {
		return -EBUSY;
	}
	if (sl == NULL) {
		return -ENODEV;
	}
	if (!(sl->spec.protocols & rq->protocol->sii_bit)) {
		return -ENOTSUP;
	}
	if (rq->timeout.ns <= 0) {
		return -EINVAL;
	}
	rq->result = -EINPROGRESS;
	rq->detail = 0;
	rq->is_mailbox_error = 0;
	rq->has_gap = 0;
	rq->len = 0;
	rq->total = 0;
	rq->step = REQUEST_QUEUED;
	rq->not_before = (mono_t){ 0 };
	rq->next = NULL;
	rq->mail_capacity = (uint16_t)(sl->spec.out_bytes - MAILBOX_HEADER_BYTES);
	rq->mail_room = (uint16_t)(sl->spec.in_bytes - MAILBOX_HEADER_BYTES);
	memset(&rq->state, 0, sizeof(rq->state));
	for (at = &sl->queue; *at != NULL;) {
		at = &(*at)->next;
	}
	*at = rq;
	mb->requests++;
	return 0;
}

void mailbox_cancel(struct mailbox_engine *mb, struct mailbox_request *rq)
{
	if (mailbox_is_running(rq)) {
		give_up(mb, mb->slave[rq->slave_pos], rq, -ECANCELED);
	}
}

int mailbox_is_busy(const struct mailbox_engine *mb)
{
	return mb->requests > 0 || mb->flight_count > 0;
}

/* 0; -ECANCELED. */
static int step_and_wait(struct mailbox_engine *mb)
{
	mono_t before = now_of(mb);

	mailbox_step(mb);
	if (now_of(mb).ns != before.ns && mb->flight_count > 0) {
		return 0; /* direct mode: the step has waited for a frame */
	}
	return mb->wire.sleep(mb->wire.ctx, (span_t){ NOT_BUSY_NS });
}

int mailbox_wait(struct mailbox_engine *mb, struct mailbox_request *rq)
{
	while (mailbox_is_running(rq)) {
		int r = step_and_wait(mb);

		if (r < 0) {
			mailbox_cancel(mb, rq);
		}
	}
	return rq->result;
}

int mailbox_wait_all(struct mailbox_engine *mb)
{
	while (mb->requests > 0) {
		int r = step_and_wait(mb);

		if (r < 0) {
			return r;
		}
	}
	return 0;
}

void mailbox_status_hint(struct mailbox_engine *mb, uint16_t slave_pos, int is_full, mono_t sent)
{
	struct box_slave *sl = slave_at(mb, slave_pos);

	if (sl != NULL) {
		sl->reader.hint_sent = sent;
		sl->reader.is_full_hint = is_full && sent.ns > sl->reader.emptied_at.ns;
	}
}

void mailbox_sink_set(struct mailbox_engine *mb, enum mailbox_type type,
		      void (*take)(void *ctx, uint16_t slave_pos, const uint8_t *data, size_t len),
		      void *ctx)
{
	mb->sink[type] = (struct mailbox_sink){ .take = take, .ctx = ctx };
}

const struct mailbox_counters *mailbox_counters_of(const struct mailbox_engine *mb,
						   uint16_t slave_pos)
{
	static const struct mailbox_counters none;

	return slave_pos < mb->slave_end && mb->slave[slave_pos] != NULL
		       ? &mb->slave[slave_pos]->counters
		       : &none;
}
