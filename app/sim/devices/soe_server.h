/* SPDX-License-Identifier: MIT */
/*
 * A slave's SoE server: a small drive with parameters of each kind (numbers, texts, lists, one that
 * takes several mails, a procedure command that reports its end with a notification).
 */
#ifndef SIM_DEVICES_SOE_SERVER_H
#define SIM_DEVICES_SOE_SERVER_H

#include "devices/mailbox.h"

enum {
	SOE_IDN_CYCLE = 1,      /* S-0-0001: 2 bytes, 250 to 10000 us */
	SOE_IDN_ALL = 17,       /* S-0-0017: list of all IDNs */
	SOE_IDN_VERSION = 30,   /* S-0-0030: text */
	SOE_IDN_VELOCITY = 40,  /* S-0-0040: 4 bytes, read only */
	SOE_IDN_RESET = 99,     /* S-0-0099: procedure command */
	SOE_IDN_TABLE = 0x8001, /* P-0-0001: list of 300 numbers of 4 bytes */
	SOE_SERVER_IDNS = 6,
	SOE_VALUE_BYTES = 1204,  /* the longest value, with its list header */
	SOE_ANSWER_BYTES = 1536, /* and all other elements */
	SOE_COMMAND_NS = 50000000,
};

struct soe_value {
	uint8_t bytes[SOE_VALUE_BYTES];
	size_t len;
};

struct soe_server {
	struct soe_value value[SOE_SERVER_IDNS];
	uint16_t state[SOE_SERVER_IDNS];
	uint8_t incoming[SOE_VALUE_BYTES]; /* of a write in fragments */
	size_t incoming_len;
	uint16_t incoming_left; /* fragments that are to follow */
	uint8_t is_too_long;
	uint8_t outgoing[SOE_ANSWER_BYTES]; /* of a read in fragments */
	size_t outgoing_len;
	size_t outgoing_pos;
	uint16_t outgoing_idn;
	uint8_t outgoing_elements;
	uint8_t drive;
	int64_t command_until_ns; /* a procedure command runs; 0: none */
};

void soe_server_reset(struct soe_server *s);
/** A mailbox_server's answer() and next(), the server as context. */
size_t soe_server_answer(void *ctx, const struct mailbox_call *call);
size_t soe_server_next(void *ctx, const struct mailbox_call *call);

#endif
