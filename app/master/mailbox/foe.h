/* SPDX-License-Identifier: MIT */
/*
 * Parameters and state of a FoE request (mailbox.h): a file read from a slave or written to it, in
 * any state with a mailbox. @buffer and @capacity of the request are the file (write) or where it
 * goes (read). On -EREMOTEIO @detail is the slave's error code (enum foe_error) and text[] what it
 * said; on -ETIMEDOUT with is_busy the slave answered BUSY for longer than busy_limit.
 */
#ifndef MAILBOX_FOE_H
#define MAILBOX_FOE_H

#include <stddef.h>
#include <stdint.h>

#include "base/platform.h"

enum { FOE_NAME_BYTES = 64, FOE_TEXT_BYTES = 48 };

struct foe_parameters {
	uint8_t operation; /* FOE_READ or FOE_WRITE (wire/foe.h) */
	uint32_t password; /* 0: none */
	const char *name;  /* 1 to FOE_NAME_BYTES bytes that fit one mail; kept until the end */
	span_t busy_limit; /* BUSY for one packet; 0: 60 s */
};

enum foe_step { FOE_STEP_OPEN, FOE_STEP_DATA, FOE_STEP_ACK, FOE_STEP_LAST_ACK };

struct foe_state {
	enum foe_step step;
	uint8_t is_begun; /* the slave may have a transfer to end */
	uint8_t is_busy;  /* the last answer was BUSY */
	uint32_t packet;  /* the one that is sent or acknowledged next */
	size_t in_mail;   /* data bytes of the packet composed last */
	span_t busy_time; /* of this packet, so far */
	span_t pause;
	uint16_t busy_done; /* what BUSY said last */
	uint16_t busy_all;
	char text[FOE_TEXT_BYTES]; /* of the slave's last error or BUSY; printable */
};

struct mailbox_protocol;
extern const struct mailbox_protocol foe_protocol;

#endif
