/* SPDX-License-Identifier: MIT */
#include "network/eoe_switch.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/limits.h"
#include "mailbox/mailbox.h"
#include "network/mac_table.h"
#include "wire/sii.h"

enum {
	HOST_PORT = LIMIT_SLAVES,
	FRAMES_PER_PASS = 32,
	SOURCE_AT = 6,
	ETHERNET_MIN = 14,
};

/* A frame that is in one or more queues. */
struct frame {
	uint16_t users;
	uint16_t len;
	uint8_t bytes[EOE_FRAME_MAX_BYTES];
};

struct port {
	struct eoe_switch *sw;
	struct eoe_assembly in;
	struct mailbox_request request; /* sends the queue's first frame */
	uint16_t queue[EOE_SWITCH_QUEUE];
	unsigned head;
	unsigned count;
	uint8_t frame_number;
};

struct eoe_switch {
	struct eoe_switch_host host;
	struct mailbox_engine *mb; /* whose sink this is; NULL: none */
	size_t slave_count;
	mono_t now;
	struct eoe_switch_counters counters;
	struct mac_table macs;
	struct frame frame[EOE_SWITCH_FRAMES];
	struct port port[LIMIT_SLAVES];
};

int eoe_switch_create(const struct eoe_switch_host *host, struct eoe_switch **ret_switch)
{
	struct eoe_switch *sw = calloc(1, sizeof(*sw));

	if (sw == NULL) {
		return -ENOMEM;
	}
	sw->host = *host;
	for (size_t i = 0; i < LIMIT_SLAVES; i++) {
		sw->port[i].sw = sw;
	}
	*ret_switch = sw;
	return 0;
}

void eoe_switch_destroy(struct eoe_switch *sw)
{
	if (sw != NULL) {
		eoe_switch_detach(sw);
		free(sw);
	}
}

const struct eoe_switch_counters *eoe_switch_counters(const struct eoe_switch *sw)
{
	return &sw->counters;
}

/* --- queues --- */

static uint16_t free_frame(const struct eoe_switch *sw)
{
	uint16_t i = 0;

	while (i < EOE_SWITCH_FRAMES && sw->frame[i].users > 0) {
		i++;
	}
	return i;
}

static void drop_first(struct port *port)
{
	port->sw->frame[port->queue[port->head]].users--;
	port->head = (port->head + 1) % EOE_SWITCH_QUEUE;
	port->count--;
}

static void enqueue(struct eoe_switch *sw, uint16_t pos, uint16_t index)
{
	struct port *port = &sw->port[pos];

	if (port->count == EOE_SWITCH_QUEUE) {
		sw->counters.queue_full++;
		return;
	}
	port->queue[(port->head + port->count) % EOE_SWITCH_QUEUE] = index;
	port->count++;
	sw->frame[index].users++;
}

static void send_to_host(struct eoe_switch *sw, const uint8_t *bytes, size_t len)
{
	if (sw->host.send(sw->host.ctx, bytes, len) < 0) {
		sw->counters.host_lost++;
	} else {
		sw->counters.to_host++;
	}
}

static int has_eoe(const struct eoe_switch *sw, size_t pos)
{
	return mailbox_slave_has(sw->mb, (uint16_t)pos, SII_MAILBOX_EOE);
}

/* To the slave @to, or all but @from. */
static void send_to_slaves(struct eoe_switch *sw, uint16_t from, uint16_t to, const uint8_t *bytes,
			   size_t len)
{
	uint16_t index = free_frame(sw);

	if (index == EOE_SWITCH_FRAMES) {
		sw->counters.queue_full++;
		return;
	}
	memcpy(sw->frame[index].bytes, bytes, len);
	sw->frame[index].len = (uint16_t)len;
	for (uint16_t pos = 0; pos < sw->slave_count; pos++) {
		if (pos != from && (to == MAC_NO_PORT || to == pos) && has_eoe(sw, pos)) {
			enqueue(sw, pos, index);
		}
	}
}

static void forward(struct eoe_switch *sw, uint16_t from, const uint8_t *bytes, size_t len)
{
	uint16_t to = mac_table_find(&sw->macs, bytes, sw->now);

	mac_table_learn(&sw->macs, bytes + SOURCE_AT, from, sw->now);
	if (to == from) {
		return; /* both are behind the same port */
	}
	if (from != HOST_PORT && (to == HOST_PORT || to == MAC_NO_PORT)) {
		send_to_host(sw, bytes, len);
	}
	if (to != HOST_PORT) {
		send_to_slaves(sw, from, to, bytes, len);
	}
}

/* --- slaves --- */

static void take_fragment(void *ctx, uint16_t slave_pos, const uint8_t *data, size_t len)
{
	struct eoe_switch *sw = ctx;
	struct eoe_assembly *in = &sw->port[slave_pos].in;
	int r = eoe_assemble(in, data, len);

	if (r < 0) {
		sw->counters.bad_fragments++;
		sw->counters.bad_slave = slave_pos;
		return;
	}
	if (r == 0) {
		return;
	}
	if (in->len < ETHERNET_MIN || mac_is_group(in->frame + SOURCE_AT)) {
		sw->counters.invalid_frames++;
		sw->counters.bad_slave = slave_pos;
		return;
	}
	sw->counters.from_slaves++;
	forward(sw, slave_pos, in->frame, in->len);
}

static void frame_sent(void *ctx, struct mailbox_request *rq)
{
	struct port *port = ctx;

	if (rq->result < 0) {
		port->sw->counters.not_taken++;
	} else {
		port->sw->counters.to_slaves++;
	}
	drop_first(port);
}

static void drop_queue(struct port *port)
{
	while (port->count > 0) {
		port->sw->counters.not_taken++;
		drop_first(port);
	}
}

static void send_next(struct eoe_switch *sw, uint16_t pos, span_t timeout)
{
	struct port *port = &sw->port[pos];
	struct frame *frame = &sw->frame[port->queue[port->head]];

	port->frame_number = (uint8_t)((port->frame_number + 1) % EOE_FRAME_NUMBERS);
	port->request = (struct mailbox_request){
		.protocol = &eoe_protocol,
		.slave_pos = pos,
		.with.eoe = { .operation = EOE_FRAGMENT, .frame_number = port->frame_number },
		.buffer = frame->bytes,
		.capacity = frame->len,
		.timeout = timeout,
		.done = frame_sent,
		.ctx = port,
	};
	if (mailbox_submit(sw->mb, &port->request) < 0) {
		drop_queue(port);
	}
}

static void read_host(struct eoe_switch *sw)
{
	uint8_t bytes[EOE_FRAME_MAX_BYTES + 1]; /* one more: a longer frame is cut by the kernel */

	for (unsigned n = 0; n < FRAMES_PER_PASS; n++) {
		int len = sw->host.receive(sw->host.ctx, bytes, sizeof(bytes));

		if (len < 0) {
			return;
		}
		sw->counters.from_host++;
		if (len < ETHERNET_MIN || len > EOE_FRAME_MAX_BYTES) {
			sw->counters.host_lost++;
		} else {
			forward(sw, HOST_PORT, bytes, (size_t)len);
		}
	}
}

/* --- public --- */

void eoe_switch_service(struct eoe_switch *sw, struct mailbox_engine *mb, size_t slave_count,
			span_t timeout, mono_t now)
{
	sw->now = now;
	if (sw->mb != mb && mb != NULL) {
		mailbox_sink_set(mb, MAILBOX_TYPE_EOE, take_fragment, sw);
		sw->mb = mb;
	}
	sw->slave_count = slave_count < LIMIT_SLAVES ? slave_count : LIMIT_SLAVES;
	read_host(sw);
	for (uint16_t pos = 0; pos < sw->slave_count; pos++) {
		const struct port *port = &sw->port[pos];

		if (port->count > 0 && !mailbox_is_running(&port->request)) {
			send_next(sw, pos, timeout);
		}
	}
}

void eoe_switch_detach(struct eoe_switch *sw)
{
	if (sw->mb == NULL) {
		return;
	}
	for (uint16_t pos = 0; pos < LIMIT_SLAVES; pos++) {
		struct port *port = &sw->port[pos];

		mailbox_cancel(sw->mb, &port->request);
		drop_queue(port);
		port->in.len = 0;
		port->in.next_fragment = 0;
	}
	mailbox_sink_set(sw->mb, MAILBOX_TYPE_EOE, NULL, NULL);
	memset(&sw->macs, 0, sizeof(sw->macs)); /* the slaves may be others then */
	sw->mb = NULL;
}
