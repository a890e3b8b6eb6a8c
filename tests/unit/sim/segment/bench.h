/* SPDX-License-Identifier: MIT */
/* A segment and a hand that sends one datagram at a time. */
#ifndef TESTS_UNIT_SIM_BENCH_H
#define TESTS_UNIT_SIM_BENCH_H

#include <stddef.h>
#include <stdint.h>

#include "segment/segment.h"
#include "wire/datagram.h"

enum {
	BENCH_SLAVES = 8,
	BENCH_SII_BYTES = 256,
	BENCH_STEP_NS = 100000, /* from one frame to the next */
	BENCH_STATION = 0x1000, /* address of the first slave, after bench_create() */
};

struct bench_slave {
	const struct esc_features *features; /* NULL: ET1100 */
	uint8_t pdi;                         /* EEPROM byte 0 */
	uint8_t config;                      /* EEPROM byte 1: 0x0141 */
	uint8_t sync_pins;                   /* EEPROM byte 3: 0x0151 */
	uint8_t no_eeprom;                   /* 1: its checksum is wrong */
	uint16_t alias;
	double ppm;
	uint64_t clock_ns;
	struct sim_device *device;
};

struct bench {
	struct segment *segment;
	int64_t now_ns;
	int64_t back_ns;
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	size_t frame_len;
	uint16_t irq; /* of the last datagram */
	uint16_t adp; /* as it came back */
	uint8_t sii[BENCH_SLAVES][BENCH_SII_BYTES];
};

/** A line of @count slaves, EEPROMs loaded, station addresses 0x1000 and up. Free with
 * bench_destroy(). */
struct bench *bench_create(const struct bench_slave *slaves, unsigned count);
/** One ET1100 behind an SPI PDI with both DC units on. */
struct bench *bench_create_one(void);
void bench_destroy(struct bench *b);

/** Send one datagram and take its answer into @data. Returns the WKC. */
uint16_t bench_send(struct bench *b, enum ecat_cmd cmd, uint16_t adp, uint16_t ado, void *data,
		    uint16_t len);
uint16_t bench_logical(struct bench *b, enum ecat_cmd cmd, uint32_t address, void *data,
		       uint16_t len);

/* To and from the slave with @station; the WKC must be 1. */
void bench_write8(struct bench *b, uint16_t station, uint16_t ado, uint8_t value);
void bench_write16(struct bench *b, uint16_t station, uint16_t ado, uint16_t value);
void bench_write32(struct bench *b, uint16_t station, uint16_t ado, uint32_t value);
void bench_write64(struct bench *b, uint16_t station, uint16_t ado, uint64_t value);
uint8_t bench_read8(struct bench *b, uint16_t station, uint16_t ado);
uint16_t bench_read16(struct bench *b, uint16_t station, uint16_t ado);
uint32_t bench_read32(struct bench *b, uint16_t station, uint16_t ado);
uint64_t bench_read64(struct bench *b, uint16_t station, uint16_t ado);

/** Set up and enable SyncManager @n. */
void bench_sm(struct bench *b, uint16_t station, unsigned n, uint16_t start, uint16_t len,
	      uint8_t control);
/** Map @len bytes: FMMU @n, @type 1 read, 2 write. */
void bench_fmmu(struct bench *b, uint16_t station, unsigned n, uint32_t logical, uint16_t len,
		uint16_t physical, uint8_t type);

void bench_pdi_read(struct bench *b, unsigned slave, uint16_t addr, void *buf, size_t len);
void bench_pdi_write(struct bench *b, unsigned slave, uint16_t addr, const void *buf, size_t len);

/** Nothing is sent for @span_ns. */
void bench_wait(struct bench *b, int64_t span_ns);

#endif
