/* SPDX-License-Identifier: MIT */
/*
 * A hostile slave's mailbox: CoE requests against mails from anywhere. The first bytes choose the
 * request; then each mail is a control byte (type in the low bits; 0x10: the slave refuses the next
 * access; 0x20: the frame that reads the mail is lost; 0x40: its header's length is the control
 * byte's value times 8; 0x80: it comes with the one before it), its length, its data.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "mailbox/mailbox.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum {
	BOX = 64,
	OUT_START = 0x1000,
	IN_START = 0x1100,
	PASS_NS = 50000,
	LOOK_NS = 100,
	PASSES_MAX = 200000,
	CHOICE_BYTES = 6,
	SM_IN = ESC_REG_SM + ESC_SM_BYTES,
	SM_STATUS = 5,
	SM_ACTIVATE = 6,
	REFUSES = 0x10,
	IS_LOST = 0x20,
	LENGTH_WRONG = 0x40,
	UNASKED = 0x80,
	WAITS = 0xff, /* for cancel_after: not cancelled, but waited for */
};

struct slave {
	const uint8_t *data;
	size_t left;
	uint8_t in[BOX];
	uint8_t counter;
	int is_full;
	int refuses;      /* the next access */
	int loses;        /* the next frame that reads the mail to its end */
	int is_lost;      /* this frame */
	uint8_t activate; /* of the SyncManager: its repeat bit is answered in the PDI control */
	int64_t now_ns;
	uint8_t frame[LIMIT_FRAME_BYTES];
	size_t frame_len;
};

static void put_mail(struct slave *s)
{
	uint8_t control;
	size_t len;

	if (s->left < 2 || s->is_full) {
		return;
	}
	control = s->data[0];
	len = s->data[1];
	s->data += 2;
	s->left -= 2;
	len = len < s->left ? len : s->left;
	len = len < BOX - MAILBOX_HEADER_BYTES ? len : BOX - MAILBOX_HEADER_BYTES;
	s->counter = mailbox_counter_next(s->counter);
	memset(s->in, 0, sizeof(s->in));
	mailbox_header_put(
		s->in, &(struct mailbox_header){
			       .data_len = (uint16_t)(control & LENGTH_WRONG ? control * 8 : len),
			       .type = control & 0x0f,
			       .counter = s->counter });
	memcpy(s->in + MAILBOX_HEADER_BYTES, s->data, len);
	s->data += len;
	s->left -= len;
	s->is_full = 1;
	s->refuses = (control & REFUSES) != 0;
	s->loses = (control & IS_LOST) != 0;
}

static uint16_t read_box(struct slave *s, const struct ecat_datagram *dg)
{
	size_t at = (size_t)dg->ado - IN_START;

	if (!s->is_full) {
		return 0;
	}
	memcpy(dg->data, s->in + at, dg->data_len);
	if (at + dg->data_len == BOX) {
		s->is_full = 0;
		s->is_lost = s->loses;
		s->loses = 0;
		if (s->left > 0 && (s->data[0] & UNASKED)) {
			put_mail(s);
		}
	}
	return 1;
}

/* Status, activation, PDI control; asked to repeat, the box is full again. */
static uint16_t meet_sync_manager(struct slave *s, const struct ecat_datagram *dg)
{
	const uint8_t reg[] = { s->is_full ? 0x08 : 0, s->activate, s->activate };
	size_t from = (size_t)dg->ado - (SM_IN + SM_STATUS);

	if (dg->cmd == ECAT_CMD_FPWR) {
		s->is_full |= from == 1 && dg->data[0] != s->activate;
		s->activate = dg->data[0];
	} else {
		memcpy(dg->data, reg + from,
		       dg->data_len < sizeof(reg) - from ? dg->data_len : sizeof(reg) - from);
	}
	return 1;
}

static uint16_t meet(struct slave *s, const struct ecat_datagram *dg)
{
	if (dg->ado == SM_IN + SM_STATUS || dg->ado == SM_IN + SM_ACTIVATE) {
		return meet_sync_manager(s, dg);
	}
	if (s->refuses) {
		s->refuses = 0;
		return 0;
	}
	if (dg->cmd == ECAT_CMD_FPRD && dg->ado >= IN_START) {
		return read_box(s, dg);
	}
	if (dg->cmd == ECAT_CMD_FPWR && dg->ado + dg->data_len == OUT_START + BOX) {
		put_mail(s);
	}
	return 1;
}

static int submit(void *ctx, const uint8_t *frame, size_t frame_len)
{
	struct slave *s = ctx;
	struct ecat_datagram dg;
	size_t pos = 0;

	memcpy(s->frame, frame, frame_len);
	s->frame_len = frame_len;
	s->is_lost = 0;
	while (ecat_frame_next(s->frame, frame_len, &pos, &dg) == 1) {
		put_le16(dg.wkc, meet(s, &dg));
	}
	return 0;
}

static int collect(void *ctx, uint8_t *ret_answer, size_t capacity)
{
	struct slave *s = ctx;

	if (s->frame_len > capacity) {
		return -EMSGSIZE;
	}
	s->now_ns += PASS_NS;
	if (s->is_lost) {
		s->is_lost = 0;
		return -ETIMEDOUT;
	}
	memcpy(ret_answer, s->frame, s->frame_len);
	return (int)s->frame_len;
}

static size_t frame_limit(void *ctx)
{
	(void)ctx;
	return LIMIT_FRAME_BYTES;
}

static mono_t now(void *ctx)
{
	struct slave *s = ctx;

	s->now_ns += LOOK_NS; /* time passes without a frame, too */
	return (mono_t){ s->now_ns };
}

static int sleep_for(void *ctx, span_t span)
{
	((struct slave *)ctx)->now_ns += span.ns;
	return 0;
}

static void check_result(const struct mailbox_request *rq)
{
	struct coe_object object;
	struct coe_entry entry;

	if (rq->result > 0 || rq->len > rq->capacity || mailbox_is_running(rq)) {
		__builtin_trap();
	}
	if (rq->result < 0) {
		return;
	}
	if (rq->with.coe.operation == COE_UPLOAD && rq->len != rq->total) {
		__builtin_trap(); /* good, but not whole */
	}
	if (rq->with.coe.operation == COE_OBJECT) {
		coe_object_get(rq->buffer, rq->len, &object);
	}
	if (rq->with.coe.operation == COE_ENTRY) {
		coe_entry_get(rq->buffer, rq->len, &entry);
	}
}

static void run(struct mailbox_engine *mb, struct mailbox_request *rq, uint8_t cancel_after)
{
	unsigned passes = 0;

	if (mailbox_submit(mb, rq) < 0) {
		__builtin_trap();
	}
	if (cancel_after == WAITS) {
		mailbox_wait(mb, rq);
	}
	while (mailbox_is_running(rq)) {
		mailbox_step(mb);
		if (++passes > PASSES_MAX) {
			__builtin_trap(); /* it never ends */
		}
		if (cancel_after > 0 && passes == cancel_after) {
			mailbox_cancel(mb, rq);
		}
	}
	check_result(rq);
}

static void take_mail(void *ctx, uint16_t slave_pos, const uint8_t *data, size_t len)
{
	struct coe_emergency em;

	(void)ctx;
	(void)slave_pos;
	coe_emergency_get(data, len, &em);
}

/* With a request open, the slave goes. */
static void leave(struct mailbox_engine *mb)
{
	uint8_t buffer[4];
	struct mailbox_request rq = { .protocol = &coe_protocol,
				      .with.coe = { .operation = COE_UPLOAD, .index = 0x6000 },
				      .buffer = buffer,
				      .capacity = sizeof(buffer),
				      .timeout = { NS_PER_MS } };

	if (mailbox_submit(mb, &rq) < 0) {
		__builtin_trap();
	}
	mailbox_step(mb);
	mailbox_slave_set(mb, 0, NULL);
	if (rq.result != -ENODEV || mailbox_wait_all(mb) != 0) {
		__builtin_trap();
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	const struct mailbox_slave_spec spec = { .station_addr = 0x1001,
						 .out_start = OUT_START,
						 .out_bytes = BOX,
						 .in_start = IN_START,
						 .in_bytes = BOX,
						 .protocols = SII_MAILBOX_COE };
	struct slave s = { .now_ns = 1 };
	const struct mailbox_wire wire = { .submit = submit,
					   .collect = collect,
					   .frame_limit = frame_limit,
					   .now = now,
					   .sleep = sleep_for,
					   .ctx = &s };
	struct mailbox_engine *mb = NULL;

	if (size < CHOICE_BYTES || mailbox_create(&wire, &mb) < 0) {
		return 0;
	}
	mailbox_sink_set(mb, MAILBOX_TYPE_COE, take_mail, NULL);
	mailbox_slave_set(mb, 0, &spec);
	s.data = data + CHOICE_BYTES;
	s.left = size - CHOICE_BYTES;
	s.refuses = data[3] >> 1 & 1;
	if (data[3] & 4) {
		mailbox_status_hint(mb, 0, data[3] >> 3 & 1, (mono_t){ s.now_ns });
	}
	/* Twice: what is late for the first meets the second. */
	for (int i = 0; i < 2; i++) {
		size_t capacity = 1 + (size_t)data[2];
		struct mailbox_request rq = {
			.protocol = &coe_protocol,
			.with.coe = { .operation = (enum coe_operation)(data[i] % 6),
				      .access =
					      data[3] & 1 ? COE_ACCESS_COMPLETE : COE_ACCESS_SINGLE,
				      .index = 0x6000,
				      .subindex = data[4] & 3,
				      .list_type = COE_LIST_ALL },
			.capacity = capacity,
			.timeout = { 10 * NS_PER_MS },
		};

		rq.buffer = calloc(1, capacity); /* its end is watched */
		if (rq.buffer != NULL) {
			run(mb, &rq, i == 1 ? data[5] : 0);
		}
		free(rq.buffer);
	}
	leave(mb);
	mailbox_destroy(mb);
	return 0;
}
