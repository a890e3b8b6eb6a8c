/* SPDX-License-Identifier: MIT */
/*
 * Parameters and state of an EoE request (mailbox.h): set or get a slave's IP parameters, or send
 * it the Ethernet frame in the buffer. Frames of the slave go to the sink of MAILBOX_TYPE_EOE,
 * fragment by fragment (eoe_assemble() of wire/eoe.h). On -EREMOTEIO @detail is the slave's enum
 * eoe_result.
 */
#ifndef MAILBOX_EOE_H
#define MAILBOX_EOE_H

#include <stdint.h>

#include "wire/eoe.h"

struct eoe_parameters {
	enum eoe_type operation; /* EOE_SET_IP, EOE_GET_IP or EOE_FRAGMENT */
	uint8_t port;            /* 0 to 15; 0: not a switch */
	uint8_t frame_number;    /* EOE_FRAGMENT: 0 to 15, another than that of the frame before */
	struct eoe_ip ip;        /* EOE_SET_IP */
};

struct eoe_state {
	struct eoe_ip ip;       /* EOE_GET_IP: the answer */
	struct eoe_split split; /* of the frame that is sent */
};

struct mailbox_protocol;
extern const struct mailbox_protocol eoe_protocol;

#endif
