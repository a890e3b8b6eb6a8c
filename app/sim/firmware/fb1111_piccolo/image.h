/* SPDX-License-Identifier: MIT */
/* A firmware image as it is sent by FoE and lies in the flash. */
#ifndef FB1111_PICCOLO_IMAGE_H
#define FB1111_PICCOLO_IMAGE_H

#include "description.h"
#include "octet.h"

/* The file: this header, little-endian, and the program behind it. */
enum piccolo_image_layout {
	IMAGE_MAGIC = 0,    /* "PIC1" */
	IMAGE_PRODUCT = 4,  /* PICCOLO_PRODUCT_CODE */
	IMAGE_LENGTH = 8,   /* octets behind the header */
	IMAGE_CRC = 12,     /* CRC-32 (IEEE 802.3) of those */
	IMAGE_VERSION = 16, /* text for 0x100A, filled up with 0 */
	IMAGE_HEADER = PICCOLO_IMAGE_HEADER_OCTETS
};

/** CRC-32 of @len octets more; begin with 0. */
uint32_t piccolo_crc32(uint32_t crc, const octet_t *data, uint32_t len);

#endif
