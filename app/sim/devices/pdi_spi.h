/* SPDX-License-Identifier: MIT */
/*
 * The ET1100's SPI slave pins (data sheet, section III): chip select and octets, each taking
 * PDI_SPI_OCTET of time. The CPU's clock is kept here: it runs ahead of the segment while a
 * burst of octets is exchanged in one call. A read looks at the ESC when its octet is clocked. A
 * write is posted, and reaches the ESC when the segment has come to the end of its last octet, so
 * that a frame in between sees the old data.
 *
 * One CPU and one ESC to an instance, no locks.
 */
#ifndef SIM_DEVICES_PDI_SPI_H
#define SIM_DEVICES_PDI_SPI_H

#include <stddef.h>
#include <stdint.h>

#include "segment/esc.h"

enum {
	PDI_SPI_OCTET_TENTH_NS = 7997, /* 799.7 ns an octet, as measured on the board */
	PDI_SPI_BURST = 32,            /* longer writes are posted in parts */
	PDI_SPI_POSTED = 8,
};

struct pdi_spi_write {
	int64_t at_ns;
	uint16_t address;
	uint8_t len;
	uint8_t data[PDI_SPI_BURST];
};

struct pdi_spi {
	struct esc *esc;
	int64_t now_ns;  /* the CPU's time, */
	uint32_t tenths; /* and tenths of a ns */

	/* the access that is going on */
	uint8_t header[3];
	uint8_t al_event[3];
	uint8_t is_selected;
	uint8_t command;
	uint8_t is_terminated; /* the master's 0xff has come */
	uint8_t is_broken;     /* it was no access that the data sheet knows */
	uint16_t address;
	unsigned pos;       /* octets since select */
	unsigned data_pos;  /* position of the first data octet */
	uint8_t latched[8]; /* a DC time, taken with its first octet */
	uint8_t latched_len;
	struct pdi_spi_write write;

	/* posted, oldest first */
	struct pdi_spi_write posted[PDI_SPI_POSTED];
	unsigned posted_first, posted_count;
	uint64_t octets; /* since power-on */
};

/** Power-on at @t_ns. */
void pdi_spi_init(struct pdi_spi *spi, struct esc *esc, int64_t t_ns);
/** The CPU does something else until @t_ns; never goes back. */
void pdi_spi_idle_until(struct pdi_spi *spi, int64_t t_ns);

void pdi_spi_select(struct pdi_spi *spi);
/** Octets out and in, one behind the other. @in may be @out, or NULL. */
void pdi_spi_exchange(struct pdi_spi *spi, const uint8_t *out, uint8_t *in, size_t len);
/** Ends the access. A breach of the protocol is counted in 0x030d. */
void pdi_spi_deselect(struct pdi_spi *spi);

/**
 * A whole access: select, @address out and in at its place, one wait state on a read, @out and @in,
 * deselect. @in may be @out; NULL: no read. Returns the CPU's time at the end of the address.
 */
int64_t pdi_spi_access(struct pdi_spi *spi, uint8_t *address, size_t address_len,
		       const uint8_t *out, uint8_t *in, size_t len);

/** When the oldest posted write is due; INT64_MAX: none. */
int64_t pdi_spi_due_ns(const struct pdi_spi *spi);
/** Let all posted writes due up to @t_ns reach the ESC. */
void pdi_spi_settle(struct pdi_spi *spi, int64_t t_ns);

#endif
