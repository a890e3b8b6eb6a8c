/* SPDX-License-Identifier: MIT */
/* What raw_client.c asks raw_match.c about mails that it did not make. Bytes may be anything. */
#ifndef MAILBOX_RAW_INTERNAL_H
#define MAILBOX_RAW_INTERNAL_H

#include "mailbox/mailbox.h"

/** Does the slave answer this mail? VoE: its vendor knows; 1. */
int raw_is_answered(const struct mailbox_request *rq);
/** Is @data an answer to it, and not an emergency, a notification, a frame or a late answer? */
int raw_is_answer(const struct mailbox_request *rq, const uint8_t *data, size_t len);
/** Fragments that follow this part of an answer; 0: it is the last one. */
uint16_t raw_fragments_left(const struct mailbox_request *rq, const uint8_t *data, size_t len);
/** The mail that ends the SDO transfer which @rq began; its length, 0: none. */
int raw_abort(const struct mailbox_request *rq, uint8_t *data, size_t capacity);

#endif
