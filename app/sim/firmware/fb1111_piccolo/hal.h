/* SPDX-License-Identifier: MIT */
/*
 * What the firmware needs of the board, and nothing else. On the F28069 these are SPI-A in mode 3
 * (CPOL = 1, CPHA = 1) at 10 Mbit/s, GPIO for chip select, EEPROM_LOADED and LED, the ADC with
 * XINT2 (wired to the ET1100's SYNC0) as start-of-conversion trigger, CPU timer 0, and the global
 * interrupt mask. In the simulator they are sim/devices/fb1111_piccolo.c.
 */
#ifndef FB1111_PICCOLO_HAL_H
#define FB1111_PICCOLO_HAL_H

#include "octet.h"

struct piccolo_hal {
	void *ctx; /* handed back in every call */

	/**
	 * One access to the ET1100, each octet MSB first, one behind the other: chip select low;
	 * @address out, what comes in meanwhile into its place; on a read one 0xff, the wait state;
	 * @len octets @out and @in; chip select high. @in may be @out; NULL: a write. Returns
	 * time_us() at the end of the address.
	 */
	uint32_t (*spi_access)(void *ctx, octet_t *address, uint16_t address_len,
			       const octet_t *out, octet_t *in, uint16_t len);
	/** Level of EEPROM_LOADED: 0 means that the ET1100's PDI does not answer yet. */
	int (*eeprom_loaded)(void *ctx);

	/** From now on every SYNC0 edge starts one conversion, in hardware, without the CPU. */
	void (*adc_start)(void *ctx);
	/** Result of the last conversion, 0..4095; waits for its end. */
	uint16_t (*adc_read)(void *ctx);
	/** Nonzero if a conversion ended before the last one was read (ADCINTOVF); clears it. */
	int (*adc_overrun)(void *ctx);

	/*
	 * The flash has two slots; the boot loader starts the one that was activated last. Erase
	 * the other one: it begins at once, and flash_is_busy() is nonzero until it is done.
	 */
	void (*flash_erase)(void *ctx);
	int (*flash_is_busy)(void *ctx);
	/** Write @len octets at @offset of the erased slot. 0, or nonzero if the flash refused. */
	int (*flash_write)(void *ctx, uint32_t offset, const octet_t *data, uint16_t len);
	/** Header (IMAGE_HEADER octets) of the running image. 0: it was programmed without one. */
	int (*flash_running)(void *ctx, octet_t *ret_header);
	/** Activate the written slot and reset the CPU; may return. */
	void (*flash_start)(void *ctx);

	void (*led)(void *ctx, int on);
	/** Free-running microseconds, wraps at 2^32; only differences are used. */
	uint32_t (*time_us)(void *ctx);
	/** Mask and unmask the SYNC0 interrupt; never nested. A masked edge stays pending. */
	void (*interrupts_off)(void *ctx);
	void (*interrupts_on)(void *ctx);
};

#endif
