/* SPDX-License-Identifier: MIT */
/*
 * Access to the ET1100's address space over SPI. ESC access is one chip-select cycle: three address
 * octets, on a read one wait-state octet, then the data (ET1100 data sheet, section III, SPI
 * slave).
 */
#ifndef FB1111_PICCOLO_SPI_H
#define FB1111_PICCOLO_SPI_H

#include "piccolo.h"

enum { SPI_CHUNK = 16 }; /* longest stretch with interrupts off, in data octets */

/* The caller keeps interrupts off, or is the interrupt. @len is 1 or more. */
void piccolo_spi_read(struct piccolo *p, uint16_t address, octet_t *data, uint16_t len);
void piccolo_spi_write(struct piccolo *p, uint16_t address, const octet_t *data, uint16_t len);
/** No access at all: only the AL events come back. */
void piccolo_spi_poll(struct piccolo *p);

/* The same from the main loop: interrupts are off for just this access. */
void piccolo_esc_read(struct piccolo *p, uint16_t address, octet_t *data, uint16_t len);
void piccolo_esc_write(struct piccolo *p, uint16_t address, const octet_t *data, uint16_t len);
octet_t piccolo_esc_read8(struct piccolo *p, uint16_t address);
uint16_t piccolo_esc_read16(struct piccolo *p, uint16_t address);
void piccolo_esc_write16(struct piccolo *p, uint16_t address, uint16_t value);

#endif
