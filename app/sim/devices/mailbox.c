/* SPDX-License-Identifier: MIT */
#include "devices/mailbox.h"

#include <string.h>

#include "base/bytes.h"
#include "wire/esc_reg.h"

enum {
	SM_REQUEST = 0,
	SM_ANSWER = 1,
	STATUS_FULL = 0x08,
	ACTIVATE_ON = 0x01,
	ACTIVATE_REPEAT = 0x02,
	PDI_REPEAT_DONE = 0x02,
	TYPE_MASK = 0x0f,
	COUNTER_SHIFT = 4,
	COUNTER_MASK = 7,
	ERROR_COMMAND = 1,
	ERROR_BYTES = 4,
};

struct sm_view {
	uint16_t start;
	uint16_t len;
	uint8_t status;
	uint8_t activate;
	uint8_t pdi_control;
};

static struct sm_view look_at(struct esc *esc, int64_t t_ns, unsigned sm)
{
	uint8_t r[ESC_SM_BYTES];

	esc_pdi_read(esc, t_ns, (uint16_t)(ESC_REG_SM + sm * ESC_SM_BYTES), r, sizeof(r));
	return (struct sm_view){ .start = get_le16(r),
				 .len = get_le16(r + 2),
				 .status = r[5],
				 .activate = r[6],
				 .pdi_control = r[7] };
}

void mailbox_reset(struct mailbox *m)
{
	*m = (struct mailbox){ .answer_len = 0 };
}

static void finish_answer(struct mailbox *m, unsigned type, size_t data_len)
{
	/* Counters go 1 to 7; 0 is for those who do not count. */
	m->answer_counter = (uint8_t)(m->answer_counter % COUNTER_MASK + 1);
	put_le16(m->answer, (uint16_t)data_len);
	put_le16(m->answer + 2, 0);
	m->answer[4] = 0;
	m->answer[5] = (uint8_t)(type | (unsigned)m->answer_counter << COUNTER_SHIFT);
	m->answer_len = MAILBOX_HEADER_BYTES + data_len;
	m->is_waiting = 1;
}

static void answer_error(struct mailbox *m, enum mailbox_error error)
{
	put_le16(m->answer + MAILBOX_HEADER_BYTES, ERROR_COMMAND);
	put_le16(m->answer + MAILBOX_HEADER_BYTES + 2, (uint16_t)error);
	finish_answer(m, MAILBOX_ERROR, ERROR_BYTES);
}

/* The last answer once more, unless it is still there. */
static void answer_again(struct mailbox *m, const struct sm_view *answer)
{
	if (m->answer_len > 0 && !(answer->status & STATUS_FULL)) {
		m->is_waiting = 1;
	}
}

static void execute(struct mailbox *m, const uint8_t *request, size_t box_bytes,
		    const struct sm_view *answer, mailbox_service service, void *ctx)
{
	size_t len = get_le16(request);
	unsigned type = request[5] & TYPE_MASK;
	uint8_t counter = request[5] >> COUNTER_SHIFT & COUNTER_MASK;
	size_t data_len;

	if (counter != 0 && counter == m->request_counter && m->answer_len > 0) {
		answer_again(m, answer); /* the master has not seen it */
		return;
	}
	m->request_counter = counter;
	if (len > box_bytes - MAILBOX_HEADER_BYTES) {
		answer_error(m, MAILBOX_INVALID_SIZE);
		return;
	}
	if (type != MAILBOX_COE) {
		answer_error(m, MAILBOX_UNSUPPORTED);
		return;
	}
	data_len = service(ctx, type, request + MAILBOX_HEADER_BYTES, len,
			   m->answer + MAILBOX_HEADER_BYTES, answer->len - MAILBOX_HEADER_BYTES);
	if (data_len > 0) {
		finish_answer(m, type, data_len);
	}
}

static int is_box(const struct sm_view *sm)
{
	return (sm->activate & ACTIVATE_ON) && sm->len > MAILBOX_HEADER_BYTES + ERROR_BYTES &&
	       sm->len <= MAILBOX_BYTES;
}

static void put_answer(struct mailbox *m, struct esc *esc, int64_t t_ns, const struct sm_view *sm)
{
	uint8_t box[MAILBOX_BYTES] = { 0 };
	size_t len = m->answer_len < sm->len ? m->answer_len : sm->len;

	/* The box must be written to its last byte, or it is not full. */
	memcpy(box, m->answer, len);
	esc_pdi_write(esc, t_ns, sm->start, box, sm->len);
	m->is_waiting = 0;
}

void mailbox_run(struct mailbox *m, struct esc *esc, int64_t t_ns, mailbox_service service,
		 void *ctx)
{
	struct sm_view request = look_at(esc, t_ns, SM_REQUEST);
	struct sm_view answer = look_at(esc, t_ns, SM_ANSWER);
	uint8_t box[MAILBOX_BYTES];

	if (!is_box(&request) || !is_box(&answer)) {
		return;
	}
	if ((answer.activate ^ answer.pdi_control) & ACTIVATE_REPEAT) {
		uint8_t done = answer.activate & PDI_REPEAT_DONE;

		answer_again(m, &answer);
		esc_pdi_write(esc, t_ns, ESC_REG_SM + SM_ANSWER * ESC_SM_BYTES + 7, &done, 1);
	}
	if (!m->is_waiting && (request.status & STATUS_FULL)) {
		esc_pdi_read(esc, t_ns, request.start, box, request.len);
		execute(m, box, request.len, &answer, service, ctx);
	}
	if (m->is_waiting && !(answer.status & STATUS_FULL)) {
		put_answer(m, esc, t_ns, &answer);
	}
}
