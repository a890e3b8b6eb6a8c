/* SPDX-License-Identifier: MIT */
/*
 * A slave's EoE server: IP parameters, and a network endpoint behind them that answers ARP and
 * ping. When its address is set, it announces it with an ARP frame that nobody asked for.
 */
#ifndef SIM_DEVICES_EOE_SERVER_H
#define SIM_DEVICES_EOE_SERVER_H

#include "devices/mailbox.h"
#include "wire/eoe.h"

enum { EOE_SERVER_QUEUE = 4 };

struct eoe_queued {
	uint8_t bytes[EOE_FRAME_MAX_BYTES];
	size_t len;
};

struct eoe_server {
	struct eoe_ip ip;
	struct eoe_assembly in;
	struct eoe_queued queue[EOE_SERVER_QUEUE]; /* frames to the master, the oldest first */
	size_t queued;
	struct eoe_split out; /* of queue[0] */
	uint8_t frame_number;
	unsigned frames; /* taken in whole */
};

void eoe_server_reset(struct eoe_server *s);
/** A mailbox_server's answer() and next(), the server as context. */
size_t eoe_server_answer(void *ctx, const struct mailbox_call *call);
size_t eoe_server_next(void *ctx, const struct mailbox_call *call);

#endif
