/* SPDX-License-Identifier: MIT */
/*
 * The application's end of the standard mailbox: SyncManager 0 brings requests, 1 takes answers. A
 * request with the counter of the one before is answered again and not executed again; a toggled
 * repeat request brings the last answer back (ETG.1000.4).
 */
#ifndef SIM_DEVICES_MAILBOX_H
#define SIM_DEVICES_MAILBOX_H

#include <stddef.h>
#include <stdint.h>

#include "segment/esc.h"

enum { MAILBOX_BYTES = 1486, MAILBOX_HEADER_BYTES = 6 };

enum mailbox_type { MAILBOX_ERROR = 0, MAILBOX_COE = 3 };

/* ETG.1000.4, mailbox error answers. */
enum mailbox_error { MAILBOX_UNSUPPORTED = 2, MAILBOX_INVALID_SIZE = 8 };

struct mailbox {
	uint8_t answer[MAILBOX_BYTES];
	size_t answer_len;  /* 0: none yet */
	uint8_t is_waiting; /* the answer could not be put into SM1 yet */
	uint8_t request_counter;
	uint8_t answer_counter;
};

/** Data of the answer to @request, which came by protocol @type; 0: none. */
typedef size_t (*mailbox_service)(void *ctx, unsigned type, const uint8_t *request,
				  size_t request_len, uint8_t *answer, size_t capacity);

/** Both counters start anew. */
void mailbox_reset(struct mailbox *m);
/** Take a request, if there is one and the last answer is out; put an answer, if SM1 is empty. */
void mailbox_run(struct mailbox *m, struct esc *esc, int64_t t_ns, mailbox_service service,
		 void *ctx);

#endif
