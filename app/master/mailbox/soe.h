/* SPDX-License-Identifier: MIT */
/*
 * Parameters and state of a SoE request (mailbox.h): elements of an IDN are read into the buffer,
 * one behind the other as they come, or the buffer is written to one element, in as many mails as
 * it takes. A list (name, unit, a value of variable length) has its header of 4 bytes.
 * Notifications and emergencies go to the sink of MAILBOX_TYPE_SOE. On -EREMOTEIO @detail is the
 * slave's enum soe_error (wire/soe.h).
 */
#ifndef MAILBOX_SOE_H
#define MAILBOX_SOE_H

#include <stddef.h>
#include <stdint.h>

#include "wire/soe.h"

struct soe_parameters {
	enum soe_operation operation; /* SOE_READ or SOE_WRITE */
	uint8_t drive;                /* 0 to SOE_DRIVES - 1 */
	uint8_t elements;             /* enum soe_element, ORed */
	uint16_t idn;                 /* bit 15: P-0 instead of S-0 */
};

struct soe_state {
	size_t in_mail;          /* bytes of the fragment composed last */
	uint16_t fragments_left; /* as the slave said last */
	uint8_t has_fragment;
};

struct mailbox_protocol;
extern const struct mailbox_protocol soe_protocol;

#endif
