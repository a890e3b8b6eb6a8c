/* SPDX-License-Identifier: MIT */
/*
 * Parameters of an AoE request (mailbox.h): the buffer is read from an index group and offset, or
 * written there; an SDO is group AOE_GROUP_SDO, offset aoe_sdo_offset() (wire/aoe.h). One mail
 * holds it all: a read asks for at most what fits, a write that does not fit is -EMSGSIZE. On
 * -EREMOTEIO
 * @detail is an SDO abort code or an ADS error.
 */
#ifndef MAILBOX_AOE_H
#define MAILBOX_AOE_H

#include <stdint.h>

#include "wire/aoe.h"

struct aoe_parameters {
	enum aoe_command command;
	struct aoe_address target;
	struct aoe_address source; /* the master's: {0} will do for most slaves */
	uint32_t group;
	uint32_t offset;
};

struct aoe_state {
	uint32_t invoke_id;
};

struct mailbox_protocol;
extern const struct mailbox_protocol aoe_protocol;

#endif
