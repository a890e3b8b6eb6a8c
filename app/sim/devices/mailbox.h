/* SPDX-License-Identifier: MIT */
/*
 * The application's end of the standard mailbox: SyncManager 0 brings requests, 1 takes answers,
 * and what a server sends without being asked. A request with the counter of the one before is
 * answered again and not executed again; a toggled repeat request brings the last message back
 * (ETG.1000.4).
 */
#ifndef SIM_DEVICES_MAILBOX_H
#define SIM_DEVICES_MAILBOX_H

#include <stddef.h>
#include <stdint.h>

#include "segment/esc.h"
#include "wire/mailbox.h"

/* One request, and where its answer goes: data without the mailbox header. */
struct mailbox_call {
	int64_t t_ns;
	const uint8_t *request;
	size_t request_len;
	size_t request_capacity; /* data bytes that SM0 takes */
	uint8_t *answer;
	size_t capacity; /* data bytes that SM1 takes */
};

/* Who serves a protocol. */
struct mailbox_server {
	enum mailbox_type type;
	/** Length of the answer; 0: none (now). */
	size_t (*answer)(void *ctx, const struct mailbox_call *call);
	/** A message without a request, its length; 0: none. NULL: never. */
	size_t (*next)(void *ctx, const struct mailbox_call *call);
	void *ctx;
};

struct mailbox {
	uint8_t answer[MAILBOX_BYTES];
	size_t answer_len;  /* 0: none yet */
	uint8_t is_waiting; /* the answer could not be put into SM1 yet */
	uint8_t is_reply;   /* the answer is that of the last request */
	uint8_t request_counter;
	uint8_t answer_counter;
	/* Misbehaving, as the ESC's mailbox_fault says. */
	int64_t not_before_ns; /* the answer is late */
	uint8_t copies;        /* it comes so often again */
	uint8_t has_fragment;  /* an EoE fragment goes out before it */
};

/** Both counters start anew. */
void mailbox_reset(struct mailbox *m);
/** Take a request, if there is one and the last answer is out; put an answer, if SM1 is empty. */
void mailbox_run(struct mailbox *m, struct esc *esc, int64_t t_ns,
		 const struct mailbox_server *server, size_t server_count);

#endif
