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
	EOE_FRAGMENT_BYTES = 36,
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
	m->answer_counter = mailbox_counter_next(m->answer_counter);
	mailbox_header_put(m->answer, &(struct mailbox_header){ .data_len = (uint16_t)data_len,
								.type = (uint8_t)type,
								.counter = m->answer_counter });
	m->answer_len = MAILBOX_HEADER_BYTES + data_len;
	m->is_waiting = 1;
}

static void answer_error(struct mailbox *m, enum mailbox_error error)
{
	mailbox_error_put(m->answer + MAILBOX_HEADER_BYTES, error);
	finish_answer(m, MAILBOX_TYPE_ERROR, MAILBOX_ERROR_BYTES);
}

/* The last answer once more, unless it is still there. */
static void answer_again(struct mailbox *m, const struct sm_view *answer)
{
	if (m->answer_len > 0 && !(answer->status & STATUS_FULL)) {
		m->is_waiting = 1;
	}
}

static const struct mailbox_server *find_server(const struct mailbox_server *server, size_t count,
						unsigned type)
{
	for (size_t i = 0; i < count; i++) {
		if (server[i].type == type) {
			return &server[i];
		}
	}
	return NULL;
}

static void execute(struct mailbox *m, const struct mailbox_call *call,
		    const struct sm_view *answer, const struct mailbox_server *servers,
		    size_t server_count)
{
	struct mailbox_header header = mailbox_header_get(call->request - MAILBOX_HEADER_BYTES);
	const struct mailbox_server *server;
	size_t data_len;

	if (header.counter != 0 && header.counter == m->request_counter) {
		if (m->is_reply) {
			answer_again(m, answer); /* the master has not seen it */
		}
		return;
	}
	m->request_counter = header.counter;
	m->is_reply = 1;
	if (header.data_len > call->request_capacity) {
		answer_error(m, MAILBOX_ERROR_INVALID_SIZE);
		return;
	}
	server = find_server(servers, server_count, header.type);
	if (server == NULL) {
		answer_error(m, MAILBOX_ERROR_UNSUPPORTED_PROTOCOL);
		return;
	}
	data_len = server->answer(server->ctx, call);
	if (data_len > 0) {
		finish_answer(m, header.type, data_len);
	} else {
		m->is_reply = 0;
	}
}

/* What a server sends by itself. */
static void take_unasked(struct mailbox *m, const struct mailbox_call *call,
			 const struct mailbox_server *servers, size_t server_count)
{
	for (size_t i = 0; i < server_count && !m->is_waiting; i++) {
		size_t data_len =
			servers[i].next != NULL ? servers[i].next(servers[i].ctx, call) : 0;

		if (data_len > 0) {
			finish_answer(m, servers[i].type, data_len);
			m->is_reply = 0;
		}
	}
}

/* The answer that was just made is changed as the fault of the ESC says. */
static void misbehave(struct mailbox *m, struct esc *esc, int64_t t_ns)
{
	struct esc_mailbox_fault *fault = &esc->mailbox_fault;

	if (fault->count == 0 || fault->kind == ESC_MAILBOX_ABORT) {
		return;
	}
	fault->count--;
	switch (fault->kind) {
	case ESC_MAILBOX_LATE:
		m->not_before_ns = t_ns + fault->by_ns;
		break;
	case ESC_MAILBOX_DOUBLE:
		m->copies = 1;
		break;
	case ESC_MAILBOX_COUNTER:
		m->answer_counter = (uint8_t)((m->answer_counter + 3) % MAILBOX_COUNTER_MAX + 1);
		m->answer[5] = (uint8_t)((m->answer[5] & 0x0f) | m->answer_counter << 4);
		break;
	case ESC_MAILBOX_LENGTH:
		put_le16(m->answer, UINT16_MAX);
		break;
	case ESC_MAILBOX_SILENT:
		m->is_waiting = 0;
		break;
	case ESC_MAILBOX_EOE:
		m->has_fragment = 1;
		break;
	case ESC_MAILBOX_GOOD:
	case ESC_MAILBOX_ABORT: /* the CoE server's */
	case ESC_MAILBOX_BUSY:
		break;
	}
}

static int is_busy(struct esc *esc)
{
	struct esc_mailbox_fault *fault = &esc->mailbox_fault;

	if (fault->kind != ESC_MAILBOX_BUSY || fault->count == 0) {
		return 0;
	}
	fault->count--;
	return 1;
}

static int is_box(const struct sm_view *sm)
{
	return (sm->activate & ACTIVATE_ON) &&
	       sm->len > MAILBOX_HEADER_BYTES + MAILBOX_ERROR_BYTES && sm->len <= MAILBOX_BYTES;
}

static void put_answer(struct mailbox *m, struct esc *esc, int64_t t_ns, const struct sm_view *sm)
{
	uint8_t box[MAILBOX_BYTES] = { 0 };
	size_t len = m->answer_len < sm->len ? m->answer_len : sm->len;

	/* The box must be written to its last byte, or it is not full. */
	if (m->has_fragment) {
		m->has_fragment = 0;
		mailbox_header_put(box, &(struct mailbox_header){ .data_len = EOE_FRAGMENT_BYTES,
								  .type = MAILBOX_TYPE_EOE });
	} else {
		memcpy(box, m->answer, len);
		m->is_waiting = m->copies > 0;
		m->copies = 0;
	}
	esc_pdi_write(esc, t_ns, sm->start, box, sm->len);
}

void mailbox_run(struct mailbox *m, struct esc *esc, int64_t t_ns,
		 const struct mailbox_server *server, size_t server_count)
{
	struct sm_view request = look_at(esc, t_ns, SM_REQUEST);
	struct sm_view answer = look_at(esc, t_ns, SM_ANSWER);
	uint8_t box[MAILBOX_BYTES];
	struct mailbox_call call = { .t_ns = t_ns,
				     .request = box + MAILBOX_HEADER_BYTES,
				     .answer = m->answer + MAILBOX_HEADER_BYTES };

	if (!is_box(&request) || !is_box(&answer)) {
		return;
	}
	call.request_capacity = request.len - MAILBOX_HEADER_BYTES;
	call.capacity = answer.len - MAILBOX_HEADER_BYTES;
	if ((answer.activate ^ answer.pdi_control) & ACTIVATE_REPEAT) {
		uint8_t done = answer.activate & PDI_REPEAT_DONE;

		answer_again(m, &answer);
		esc_pdi_write(esc, t_ns, ESC_REG_SM + SM_ANSWER * ESC_SM_BYTES + 7, &done, 1);
	}
	if (!m->is_waiting && (request.status & STATUS_FULL) && !is_busy(esc)) {
		esc_pdi_read(esc, t_ns, request.start, box, request.len);
		call.request_len = get_le16(box);
		execute(m, &call, &answer, server, server_count);
		if (m->is_waiting) {
			misbehave(m, esc, t_ns);
		}
	}
	if (!m->is_waiting && !(answer.status & STATUS_FULL)) {
		take_unasked(m, &call, server, server_count);
	}
	if (m->is_waiting && !(answer.status & STATUS_FULL) && t_ns >= m->not_before_ns) {
		put_answer(m, esc, t_ns, &answer);
	}
}
