/* SPDX-License-Identifier: MIT */
/*
 * The mailbox (ETG.1000.4 part 5.6): takes requests out of SM0, gives answers into SM1, at most
 * SPI_CHUNK octets a step so that SYNC0 is never held up. A request that comes twice with the same
 * counter is executed once, and its answer is given again.
 */
#ifndef FB1111_PICCOLO_MAILBOX_H
#define FB1111_PICCOLO_MAILBOX_H

#include "piccolo.h"

enum piccolo_mailbox_layout {
	MAILBOX_HEADER = 6, /* length 2, address 2, channel and priority, type and counter */
	MAILBOX_TYPE = 5,
	MAILBOX_TYPE_ERROR = 0,
	MAILBOX_TYPE_COE = 3,
	MAILBOX_TYPE_FOE = 4,
	MAILBOX_DATA_MAX = PICCOLO_MAILBOX_OCTETS - MAILBOX_HEADER
};

/* Detail of a mailbox error reply (ETG.1000.4). */
enum piccolo_mailbox_error {
	MAILBOX_OK = 0,
	MAILBOX_UNSUPPORTED_PROTOCOL = 2,
	MAILBOX_SERVICE_NOT_SUPPORTED = 4,
	MAILBOX_INVALID_HEADER = 5,
	MAILBOX_SIZE_TOO_SHORT = 6,
	MAILBOX_INVALID_SIZE = 8
};

/** Nothing pending, no counter seen. */
void piccolo_mailbox_reset(struct piccolo *p);
/** One unit of work, PREOP and up. Returns nonzero while more is to do at once. */
int piccolo_mailbox_step(struct piccolo *p);
/** SM1's activation octet changed; a toggled repeat request asks for the last answer again. */
void piccolo_mailbox_sm1_activated(struct piccolo *p, octet_t activate);

#endif
