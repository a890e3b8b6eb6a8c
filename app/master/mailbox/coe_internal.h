/* SPDX-License-Identifier: MIT */
/* Shared by coe.c and coe_information.c. */
#ifndef MAILBOX_COE_INTERNAL_H
#define MAILBOX_COE_INTERNAL_H

#include "mailbox/mailbox.h"

enum coe_service {
	COE_EMERGENCY = 1,
	COE_SDO_REQUEST = 2,
	COE_SDO_RESPONSE = 3,
	COE_SDO_INFORMATION = 8,
};

enum { COE_HEADER_BYTES = 2, COE_SERVICE_SHIFT = 12 };

/** As the functions of struct mailbox_protocol; for COE_LIST, COE_OBJECT, COE_ENTRY. */
int coe_information_compose(struct mailbox_request *rq, uint8_t *data, size_t capacity);
int coe_information_received(struct mailbox_request *rq, const uint8_t *data, size_t len);

#endif
