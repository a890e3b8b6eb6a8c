/* SPDX-License-Identifier: MIT */
/*
 * The SDO server (ETG.1000.6 part 5.6.2): expedited and normal upload and download. Every object
 * fits one mailbox, so segments are refused, as is complete access; there is no SDO information
 * service.
 */
#ifndef FB1111_PICCOLO_COE_H
#define FB1111_PICCOLO_COE_H

#include "mailbox.h"
#include "piccolo.h"

/**
 * Execute the CoE request in @request (mailbox data without the mailbox header); the answer goes to
 * @answer (MAILBOX_DATA_MAX octets), its length to @ret_len, 0 if there is nothing to answer.
 */
enum piccolo_mailbox_error piccolo_coe(struct piccolo *p, const octet_t *request, uint16_t len,
				       octet_t *answer, uint16_t *ret_len);

#endif
