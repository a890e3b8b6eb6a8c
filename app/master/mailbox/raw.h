/* SPDX-License-Identifier: MIT */
/*
 * A mail that somebody else has made, passed to the slave as it is, and what the slave answers,
 * passed back: the mailbox gateway. The request runs like any other of its protocol, so that it
 * never comes between the mails of another request of the engine. A mail that has no answer (an
 * SDO abort, the last FoE ACK, an EoE fragment) ends when it is in the slave's box.
 */
#ifndef MAILBOX_RAW_H
#define MAILBOX_RAW_H

#include <stddef.h>
#include <stdint.h>

#include "wire/mailbox.h"

struct mailbox_protocol;
struct mailbox_request;

/* The mail's data, behind the mailbox header, is the request's buffer. */
struct raw_parameters {
	/** One mail of the answer; most have one. */
	void (*answer)(struct mailbox_request *rq, const uint8_t *data, size_t len);
	uint8_t is_last; /* after RAW_TRANSFER_LAST: a FoE ACK is not answered */
};

struct raw_state {
	uint8_t has_fragment;
	uint16_t fragments_left;
};

/** The protocol of a raw request of @type; NULL: no slave has such mails. */
const struct mailbox_protocol *raw_protocol(enum mailbox_type type);

/* How far a transfer of several mails is, as its mails show. */
enum raw_transfer {
	RAW_TRANSFER_NONE,    /* it is over, or it never was one */
	RAW_TRANSFER_GOES_ON, /* the client's next mail belongs to it */
	RAW_TRANSFER_LAST,    /* so does the next one, which is not answered */
};

/** After @rq was sent and @answer (mailbox data; empty: none) came. */
enum raw_transfer raw_transfer_after(const struct mailbox_request *rq, const uint8_t *answer,
				     size_t answer_len);

enum { RAW_ABORT_BYTES = 10 };

/**
 * Of one who has no objects: the answer to the CoE mail @data, an abort (0x06020000), into
 * RAW_ABORT_BYTES at @ret_answer. 0; -EBADMSG: it is no SDO request.
 */
int raw_refuse_sdo(const uint8_t *data, size_t len, uint8_t *ret_answer);

#endif
