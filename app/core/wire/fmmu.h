/* SPDX-License-Identifier: MIT */
/*
 * FMMUs and SyncManagers as their registers have them (ET1100 data sheet, section II, 0x0600 and
 * 0x0800), and what a slave with them adds to the working counter of a logical datagram. Bytes from
 * a slave may be anything. Context: any, RT-safe.
 */
#ifndef WIRE_FMMU_H
#define WIRE_FMMU_H

#include <stddef.h>
#include <stdint.h>

#include "wire/esc_reg.h"

enum { FMMU_COUNT_MAX = 16, SYNC_MANAGER_COUNT_MAX = 16 };

/* Logical bits @start_bit of the first byte to @stop_bit of the last are mapped to the memory. */
struct fmmu {
	uint32_t logical;
	uint16_t bytes;
	uint8_t start_bit; /* 0 to 7 */
	uint8_t stop_bit;  /* 0 to 7 */
	uint16_t physical;
	uint8_t physical_bit; /* 0 to 7 */
	uint8_t is_read;      /* by the master: inputs */
	uint8_t is_write;     /* outputs */
	uint8_t is_active;
};

struct sync_manager {
	uint16_t start;
	uint16_t bytes;
	uint8_t is_mailbox; /* one buffer with a handshake, not three */
	uint8_t is_write;   /* written by the master */
	uint8_t has_watchdog;
	uint8_t is_active;
};

struct fmmu fmmu_parse(const uint8_t raw[ESC_FMMU_BYTES]);
struct sync_manager sync_manager_parse(const uint8_t raw[ESC_SM_BYTES]);

/**
 * What a slave whose FMMUs are the @count at @fmmu adds to the working counter of a datagram with
 * @cmd (LRW, LRD, LWR; 0 for any other) of the @len bytes from logical address @start on, if it can
 * serve all: 1 for a read and, in LRW, 2 for a write, once for the slave (ETG.1000.4).
 */
unsigned fmmu_wkc(uint8_t cmd, uint32_t start, uint32_t len, const struct fmmu *fmmu, size_t count);

#endif
