/* SPDX-License-Identifier: MIT */
/* Shared by the files that know CoE mails. */
#ifndef MAILBOX_COE_INTERNAL_H
#define MAILBOX_COE_INTERNAL_H

#include "mailbox/mailbox.h"
#include "wire/coe.h"

/** As the functions of struct mailbox_protocol; for COE_LIST, COE_OBJECT, COE_ENTRY. */
int coe_information_compose(struct mailbox_request *rq, uint8_t *data, size_t capacity);
int coe_information_received(struct mailbox_request *rq, const uint8_t *data, size_t len);

#endif
