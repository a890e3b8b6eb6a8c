/* SPDX-License-Identifier: MIT */
#include "spi.h"

#include <string.h>

enum spi_command {
	SPI_NOP = 0,             /* two address octets, no data */
	SPI_READ_WAIT_STATE = 3, /* one 0xff between address and data */
	SPI_WRITE = 4,
	SPI_ADDRESS_EXTENSION = 6 /* a third address octet follows */
};

enum { SPI_MORE = 0x00, SPI_LAST = 0xff };

/* The first two address octets bring 0x0220:0x0221 back. */
static void access(struct piccolo *p, uint16_t address, enum spi_command command,
		   const octet_t *out, octet_t *in, uint16_t len)
{
	octet_t octets[3];

	octets[0] = OCTET((unsigned)address >> 5);
	octets[1] = OCTET(((unsigned)address & 0x1fu) << 3 |
			  (unsigned)(command == SPI_NOP ? SPI_NOP : SPI_ADDRESS_EXTENSION));
	octets[2] = OCTET(((unsigned)address >> 13) << 5 | (unsigned)command << 2);
	p->accessed_us =
		p->hal.spi_access(p->hal.ctx, octets, command == SPI_NOP ? 2 : 3, out, in, len);
	p->al_event = octets_get16(octets);
}

/* The master's 0xff with the last octet keeps the ET1100 from fetching one more. */
void piccolo_spi_read(struct piccolo *p, uint16_t address, octet_t *data, uint16_t len)
{
	memset(data, SPI_MORE, len * sizeof(*data));
	data[len - 1u] = SPI_LAST;
	access(p, address, SPI_READ_WAIT_STATE, data, data, len);
}

void piccolo_spi_write(struct piccolo *p, uint16_t address, const octet_t *data, uint16_t len)
{
	access(p, address, SPI_WRITE, data, 0, len);
}

void piccolo_spi_poll(struct piccolo *p)
{
	access(p, 0, SPI_NOP, 0, 0, 0);
}

void piccolo_esc_read(struct piccolo *p, uint16_t address, octet_t *data, uint16_t len)
{
	p->hal.interrupts_off(p->hal.ctx);
	piccolo_spi_read(p, address, data, len);
	p->hal.interrupts_on(p->hal.ctx);
}

void piccolo_esc_write(struct piccolo *p, uint16_t address, const octet_t *data, uint16_t len)
{
	p->hal.interrupts_off(p->hal.ctx);
	piccolo_spi_write(p, address, data, len);
	p->hal.interrupts_on(p->hal.ctx);
}

octet_t piccolo_esc_read8(struct piccolo *p, uint16_t address)
{
	octet_t data[1];

	piccolo_esc_read(p, address, data, 1);
	return data[0];
}

uint16_t piccolo_esc_read16(struct piccolo *p, uint16_t address)
{
	octet_t data[2];

	piccolo_esc_read(p, address, data, 2);
	return octets_get16(data);
}

void piccolo_esc_write16(struct piccolo *p, uint16_t address, uint16_t value)
{
	octet_t data[2];

	octets_put16(data, value);
	piccolo_esc_write(p, address, data, 2);
}
