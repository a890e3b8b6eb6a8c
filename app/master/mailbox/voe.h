/* SPDX-License-Identifier: MIT */
/*
 * Parameters of a VoE request (mailbox.h): @len bytes of the buffer are sent under a vendor's
 * header; an answer of the same vendor, if one is expected, replaces them (request's len bytes).
 */
#ifndef MAILBOX_VOE_H
#define MAILBOX_VOE_H

#include <stddef.h>
#include <stdint.h>

enum voe_expect { VOE_ANSWER, VOE_NO_ANSWER };

struct voe_parameters {
	uint32_t vendor;
	uint16_t type; /* the vendor's own */
	enum voe_expect expect;
	size_t len; /* of what is sent: at most the buffer's capacity, and what one mail takes */
};

struct voe_state {
	uint16_t type; /* of the answer */
};

struct mailbox_protocol;
extern const struct mailbox_protocol voe_protocol;

#endif
