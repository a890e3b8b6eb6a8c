/* SPDX-License-Identifier: MIT */
/*
 * Firmware update by FoE (ETG.1000.6 part 5.8), in BOOT only: the file goes to the update slot of
 * the flash while it comes, is checked (header, product, length, CRC-32) at its end, and is started
 * when the master leads the slave from BOOT to INIT. A file that is refused leaves the running
 * image as it is. While the slot is being erased, data is answered with BUSY.
 */
#ifndef FB1111_PICCOLO_FOE_H
#define FB1111_PICCOLO_FOE_H

#include "image.h"
#include "mailbox.h"
#include "piccolo.h"

/** No transfer goes on. */
void piccolo_foe_reset(struct piccolo *p);
/** Nonzero: a whole, checked image waits to be started. */
int piccolo_foe_has_image(const struct piccolo *p);
/** As piccolo_coe(), for a FoE request. */
enum piccolo_mailbox_error piccolo_foe(struct piccolo *p, const octet_t *request, uint16_t len,
				       octet_t *answer, uint16_t *ret_len);
#endif
