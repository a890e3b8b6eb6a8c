/* SPDX-License-Identifier: MIT */
/*
 * Firmware update by FoE (ETG.1000.6 part 5.8), in BOOT only: the file goes to the update slot of
 * the flash while it comes, is checked (header, product, length, CRC-32) at its end, and is started
 * when the master leads the slave from BOOT to INIT. A file that is refused leaves the running
 * image as it is. While the slot is being erased, data is answered with BUSY.
 */
#ifndef FB1111_PICCOLO_FOE_H
#define FB1111_PICCOLO_FOE_H

#include "mailbox.h"
#include "piccolo.h"

/* The file: this header, little-endian, and the program behind it. */
enum piccolo_image_layout {
	IMAGE_MAGIC = 0,    /* "PIC1" */
	IMAGE_PRODUCT = 4,  /* PICCOLO_PRODUCT_CODE */
	IMAGE_LENGTH = 8,   /* octets behind the header */
	IMAGE_CRC = 12,     /* CRC-32 (IEEE 802.3) of those */
	IMAGE_VERSION = 16, /* text for 0x100A, filled up with 0 */
	IMAGE_HEADER = PICCOLO_IMAGE_HEADER_OCTETS
};

/** No transfer goes on. */
void piccolo_foe_reset(struct piccolo *p);
/** Nonzero: a whole, checked image waits to be started. */
int piccolo_foe_has_image(const struct piccolo *p);
/** As piccolo_coe(), for a FoE request. */
enum piccolo_mailbox_error piccolo_foe(struct piccolo *p, const octet_t *request, uint16_t len,
				       octet_t *answer, uint16_t *ret_len);
/** CRC-32 of @len octets more; begin with 0. */
uint32_t piccolo_crc32(uint32_t crc, const octet_t *data, uint32_t len);

#endif
