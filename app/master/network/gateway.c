/* SPDX-License-Identifier: MIT */
#include "network/gateway.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "mailbox/mailbox.h"

/* A client that is in a transfer and sends nothing for so long is no longer waited for. */
#define HOLD_NS (500 * NS_PER_MS)

enum { NO_SLAVE = 0xffff, MASTER_ADDRESS = 0 };

struct mail {
	struct mailbox_request request;
	struct gateway *gateway;
	struct gateway_peer peer;
	uint8_t is_used;
	uint8_t is_forgotten; /* nobody waits for the answer */
	struct mailbox_header header;
	struct mail *next; /* that waits, in the order of arrival */
	uint8_t data[GATEWAY_DATA_BYTES];
};

/* A transfer of one client that goes on. */
struct hold {
	enum raw_transfer transfer;
	struct gateway_peer holder;
	mono_t until;
};

/* The protocols whose transfers have several mails. */
enum hold_of { HOLD_COE, HOLD_FOE, HOLD_SOE, HOLDS };

/* Of one slave. */
struct lane {
	struct mail *sent; /* with the slave; NULL: none */
	struct hold hold[HOLDS];
};

struct gateway {
	struct gateway_out out;
	struct mailbox_engine *mb; /* that requests were given to */
	struct gateway_counters counters;
	mono_t now;
	unsigned open;
	struct mail *first; /* of those that wait */
	struct mail mail[GATEWAY_MAILS];
	struct lane lane[LIMIT_SLAVES];
};

int gateway_create(const struct gateway_out *out, struct gateway **ret_gateway)
{
	struct gateway *gw = calloc(1, sizeof(*gw));

	if (gw == NULL) {
		return -ENOMEM;
	}
	gw->out = *out;
	*ret_gateway = gw;
	return 0;
}

void gateway_destroy(struct gateway *gw)
{
	if (gw != NULL) {
		gateway_detach(gw);
		free(gw);
	}
}

struct gateway_counters *gateway_counters(struct gateway *gw)
{
	return &gw->counters;
}

unsigned gateway_open(const struct gateway *gw)
{
	return gw->open;
}

static int is_same(const struct gateway_peer *a, const struct gateway_peer *b)
{
	return a->connection == b->connection &&
	       memcmp(&a->address, &b->address, sizeof(a->address)) == 0;
}

/* --- answers --- */

static void reply(struct gateway *gw, const struct gateway_peer *peer,
		  const struct gateway_mail *mail)
{
	uint8_t frame[GATEWAY_FRAME_BYTES];

	gw->out.send(gw->out.ctx, peer, frame, gateway_frame_put(frame, mail));
}

static void refuse(struct gateway *gw, const struct mail *m, enum mailbox_error error)
{
	uint8_t data[MAILBOX_ERROR_BYTES];
	struct gateway_mail answer = { .header = m->header, .data = data };

	mailbox_error_put(data, error);
	answer.header.type = MAILBOX_TYPE_ERROR;
	answer.header.data_len = sizeof(data);
	gw->counters.refused++;
	reply(gw, &m->peer, &answer);
}

/* The master has no objects: each SDO request is aborted. */
static void answer_for_master(struct gateway *gw, const struct mail *m)
{
	uint8_t data[RAW_ABORT_BYTES];
	struct gateway_mail answer = { .header = m->header, .data = data };

	if (m->header.type != MAILBOX_TYPE_COE ||
	    raw_refuse_sdo(m->data, m->header.data_len, data) < 0) {
		refuse(gw, m, MAILBOX_ERROR_UNSUPPORTED_PROTOCOL);
		return;
	}
	answer.header.data_len = sizeof(data);
	gw->counters.refused++;
	reply(gw, &m->peer, &answer);
}

/* --- mails --- */

static void release(struct gateway *gw, struct mail *m)
{
	m->is_used = 0;
	gw->open--;
}

int gateway_is_full(const struct gateway *gw, const struct gateway_peer *peer)
{
	unsigned own = 0;
	unsigned udp = 0;

	for (size_t i = 0; i < GATEWAY_MAILS; i++) {
		const struct mail *m = &gw->mail[i];

		own += m->is_used && is_same(&m->peer, peer);
		udp += m->is_used && m->peer.connection == 0;
	}
	return gw->open == GATEWAY_MAILS || own >= GATEWAY_MAILS_OF_PEER ||
	       (peer->connection == 0 && udp >= GATEWAY_MAILS_OF_UDP);
}

static struct mail *free_place(struct gateway *gw)
{
	size_t i = 0;

	while (gw->mail[i].is_used) {
		i++;
	}
	return &gw->mail[i];
}

void gateway_take(struct gateway *gw, const struct gateway_peer *peer,
		  const struct gateway_mail *mail)
{
	struct mail **end = &gw->first;
	struct mail *m;

	gw->counters.mails++;
	if (gateway_is_full(gw, peer)) {
		gw->counters.dropped++;
		return;
	}
	m = free_place(gw);
	memset(&m->request, 0, sizeof(m->request));
	m->gateway = gw;
	m->peer = *peer;
	m->is_used = 1;
	m->is_forgotten = 0;
	m->header = mail->header;
	m->next = NULL;
	memcpy(m->data, mail->data, mail->header.data_len);
	while (*end != NULL) {
		end = &(*end)->next;
	}
	*end = m;
	gw->open++;
}

void gateway_forget(struct gateway *gw, const struct gateway_peer *peer)
{
	struct mail **at = &gw->first;

	while (*at != NULL) {
		struct mail *m = *at;

		if (is_same(&m->peer, peer)) {
			*at = m->next;
			release(gw, m);
		} else {
			at = &m->next;
		}
	}
	for (size_t i = 0; i < GATEWAY_MAILS; i++) {
		struct mail *m = &gw->mail[i];

		m->is_forgotten |= m->is_used && is_same(&m->peer, peer);
	}
}

/* --- at the slave --- */

static struct hold *hold_of(struct gateway *gw, uint16_t pos, uint8_t type)
{
	struct hold *holds = gw->lane[pos].hold;

	switch (type) {
	case MAILBOX_TYPE_COE:
		return &holds[HOLD_COE];
	case MAILBOX_TYPE_FOE:
		return &holds[HOLD_FOE];
	case MAILBOX_TYPE_SOE:
		return &holds[HOLD_SOE];
	default: /* others have no transfers; a client's byte */
		return NULL;
	}
}

static void note_transfer(struct gateway *gw, const struct mail *m, enum raw_transfer transfer)
{
	struct hold *hold = hold_of(gw, m->request.slave_pos, m->header.type);

	if (hold != NULL) {
		*hold = (struct hold){ .transfer = transfer,
				       .holder = m->peer,
				       .until = mono_add(gw->now, (span_t){ HOLD_NS }) };
	}
}

static void take_answer(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	struct mail *m = rq->ctx;
	struct gateway *gw = m->gateway;
	struct gateway_mail answer = { .header = m->header, .data = data };

	answer.header.data_len = (uint16_t)len;
	note_transfer(gw, m, raw_transfer_after(rq, data, len));
	if (!m->is_forgotten) {
		gw->counters.answers++;
		reply(gw, &m->peer, &answer);
	}
}

static void request_done(void *ctx, struct mailbox_request *rq)
{
	struct mail *m = ctx;
	struct gateway *gw = m->gateway;

	gw->lane[rq->slave_pos].sent = NULL;
	if (rq->result < 0 || m->is_forgotten) {
		note_transfer(gw, m, RAW_TRANSFER_NONE);
	} else if (rq->state.raw.has_fragment == 0) { /* sent, and no answer is awaited */
		note_transfer(gw, m, raw_transfer_after(rq, NULL, 0));
	}
	if (rq->result == -EMSGSIZE && !m->is_forgotten) {
		refuse(gw, m, MAILBOX_ERROR_INVALID_SIZE);
	} else if (rq->is_mailbox_error && !m->is_forgotten) {
		refuse(gw, m, (enum mailbox_error)rq->detail);
	} else if (rq->result < 0) {
		gw->counters.unanswered++;
	}
	release(gw, m);
}

static uint16_t find_slave(const struct gateway_bus *bus, uint16_t station)
{
	for (size_t i = 0; i < bus->slave_count && i < LIMIT_SLAVES; i++) {
		if (bus->slaves[i].station_addr == station) {
			return (uint16_t)i;
		}
	}
	return NO_SLAVE;
}

static void submit(struct gateway *gw, const struct gateway_bus *bus, struct mail *m, uint16_t pos)
{
	struct lane *lane = &gw->lane[pos];
	const struct hold *hold = hold_of(gw, pos, m->header.type);
	int is_last = hold != NULL && hold->transfer == RAW_TRANSFER_LAST &&
		      is_same(&hold->holder, &m->peer);
	int r;

	m->request = (struct mailbox_request){
		.protocol = raw_protocol((enum mailbox_type)m->header.type),
		.slave_pos = pos,
		.with.raw = { .answer = take_answer, .is_last = (uint8_t)is_last },
		.buffer = m->data,
		.capacity = m->header.data_len,
		.timeout = bus->timeout,
		.done = request_done,
		.ctx = m,
	};
	lane->sent = m;
	r = m->request.protocol == NULL ? -ENOTSUP : mailbox_submit(bus->mb, &m->request);
	if (r < 0) {
		lane->sent = NULL;
		refuse(gw, m, MAILBOX_ERROR_UNSUPPORTED_PROTOCOL);
		release(gw, m);
	}
}

/* 1: the slave is busy with another one, or held for another client. */
static int must_wait(struct gateway *gw, const struct mail *m, uint16_t pos)
{
	const struct hold *hold = hold_of(gw, pos, m->header.type);

	return gw->lane[pos].sent != NULL ||
	       (hold != NULL && hold->transfer != RAW_TRANSFER_NONE &&
		gw->now.ns < hold->until.ns && !is_same(&hold->holder, &m->peer));
}

static void dispatch(struct gateway *gw, const struct gateway_bus *bus, struct mail *m)
{
	uint16_t pos = find_slave(bus, m->header.address);

	if (m->header.address == MASTER_ADDRESS) {
		answer_for_master(gw, m);
		release(gw, m);
	} else if (pos == NO_SLAVE) {
		refuse(gw, m, MAILBOX_ERROR_INVALID_HEADER);
		release(gw, m);
	} else {
		submit(gw, bus, m, pos);
	}
}

static void drop_waiting(struct gateway *gw)
{
	while (gw->first != NULL) {
		struct mail *m = gw->first;

		gw->first = m->next;
		gw->counters.dropped++;
		release(gw, m);
	}
}

void gateway_step(struct gateway *gw, const struct gateway_bus *bus, mono_t now)
{
	struct mail **at = &gw->first;

	gw->now = now;
	if (bus->mb == NULL) {
		drop_waiting(gw);
		return;
	}
	gw->mb = bus->mb;
	while (*at != NULL) {
		struct mail *m = *at;
		uint16_t pos = find_slave(bus, m->header.address);

		if (pos != NO_SLAVE && must_wait(gw, m, pos)) {
			at = &m->next;
			continue;
		}
		*at = m->next;
		dispatch(gw, bus, m);
	}
}

void gateway_detach(struct gateway *gw)
{
	if (gw->mb == NULL) {
		return;
	}
	for (size_t i = 0; i < LIMIT_SLAVES; i++) {
		if (gw->lane[i].sent != NULL) {
			mailbox_cancel(gw->mb, &gw->lane[i].sent->request);
		}
		gw->lane[i] = (struct lane){ .sent = NULL };
	}
	gw->mb = NULL;
}
