/* SPDX-License-Identifier: MIT */
#include "devices/pdi_spi.h"

#include <string.h>

#include "wire/esc_reg.h"

enum spi_command {
	SPI_NOP = 0,
	SPI_READ = 2,
	SPI_READ_WAIT_STATE = 3,
	SPI_WRITE = 4,
	SPI_ADDRESS_EXTENSION = 6,
	SPI_TERMINATION = 0xff,
	ADDRESS_OCTETS = 2, /* one more with the extension */
	TIME_OCTETS = 8,
};

void pdi_spi_init(struct pdi_spi *spi, struct esc *esc, int64_t t_ns)
{
	memset(spi, 0, sizeof(*spi));
	spi->esc = esc;
	spi->now_ns = t_ns;
}

void pdi_spi_idle_until(struct pdi_spi *spi, int64_t t_ns)
{
	if (t_ns > spi->now_ns) {
		spi->now_ns = t_ns;
		spi->tenths = 0;
	}
}

/* --- posted writes --- */

int64_t pdi_spi_due_ns(const struct pdi_spi *spi)
{
	return spi->posted_count == 0 ? INT64_MAX : spi->posted[spi->posted_first].at_ns;
}

void pdi_spi_settle(struct pdi_spi *spi, int64_t t_ns)
{
	while (spi->posted_count > 0 && spi->posted[spi->posted_first].at_ns <= t_ns) {
		const struct pdi_spi_write *w = &spi->posted[spi->posted_first];

		esc_pdi_write(spi->esc, w->at_ns, w->address, w->data, w->len);
		spi->posted_first = (spi->posted_first + 1) % PDI_SPI_POSTED;
		spi->posted_count--;
	}
}

static void post(struct pdi_spi *spi, uint16_t address, const uint8_t *data, size_t len)
{
	struct pdi_spi_write *slot;

	if (spi->posted_count == PDI_SPI_POSTED) {
		/* More than a real main loop does between two events: the oldest lands early. */
		pdi_spi_settle(spi, pdi_spi_due_ns(spi));
	}
	slot = &spi->posted[(spi->posted_first + spi->posted_count) % PDI_SPI_POSTED];
	slot->at_ns = spi->now_ns;
	slot->address = address;
	slot->len = (uint8_t)len;
	memcpy(slot->data, data, len);
	spi->posted_count++;
}

/* What has come of the write that is going on. */
static void post_part(struct pdi_spi *spi)
{
	struct pdi_spi_write *w = &spi->write;

	if (w->len > 0) {
		post(spi, w->address, w->data, w->len);
		w->address = (uint16_t)(w->address + w->len);
		w->len = 0;
	}
}

/* --- one access --- */

void pdi_spi_select(struct pdi_spi *spi)
{
	pdi_spi_settle(spi, spi->now_ns); /* what came before is in order before this */
	esc_pdi_read_al_event(spi->esc, spi->now_ns, spi->al_event);
	spi->is_broken = spi->is_selected;
	spi->is_selected = 1;
	spi->command = SPI_NOP;
	spi->pos = 0;
	spi->data_pos = 0;
	spi->is_terminated = 0;
	spi->latched_len = 0;
	spi->write.len = 0;
}

static void begin(struct pdi_spi *spi, unsigned command, unsigned data_pos)
{
	spi->command = (uint8_t)command;
	spi->data_pos = data_pos;
	spi->write.address = spi->address;
	switch (command) {
	case SPI_NOP:
	case SPI_READ:
	case SPI_WRITE:
		break;
	case SPI_READ_WAIT_STATE:
		spi->data_pos++;
		break;
	default: /* three bits of the wire; the rest is reserved */
		spi->is_broken = 1;
		break;
	}
}

/* A[12:5]; A[4:0] and command; after the extension command A[15:13], command and two zeros. */
static uint8_t take_address(struct pdi_spi *spi, uint8_t out)
{
	unsigned at = spi->pos;

	spi->header[at] = out;
	if (at == 1) {
		spi->address = (uint16_t)(spi->header[0] << 5 | out >> 3);
		if ((out & 7) != SPI_ADDRESS_EXTENSION) {
			begin(spi, out & 7u, ADDRESS_OCTETS);
		}
	} else if (at == 2) {
		spi->address = (uint16_t)(spi->address | (out >> 5) << 13);
		spi->is_broken |= (out & 3) != 0;
		begin(spi, out >> 2 & 7u, ADDRESS_OCTETS + 1);
	}
	return spi->al_event[at];
}

/* The 64-bit times are taken as a whole with their first octet (data sheet, 0x0910 and 0x0990). */
static int is_time(uint16_t address)
{
	return address >= ESC_REG_DC_RECEIVE_TIME_PORT && address < ESC_REG_DC_SYNC1_CYCLE &&
	       address % TIME_OCTETS == 0 && address != (ESC_REG_DC_SYNC0_STATUS & ~7);
}

static void latch(struct pdi_spi *spi)
{
	if (is_time(spi->address)) {
		spi->latched_len = sizeof(spi->latched);
		esc_pdi_read(spi->esc, spi->now_ns, spi->address, spi->latched,
			     sizeof(spi->latched));
	}
}

static uint8_t read_octet(struct pdi_spi *spi)
{
	unsigned n = spi->pos - spi->data_pos;
	uint8_t value;

	if (n == 0) {
		latch(spi);
	}
	if (n < spi->latched_len) {
		return spi->latched[n];
	}
	esc_pdi_read(spi->esc, spi->now_ns, (uint16_t)(spi->address + n), &value, 1);
	return value;
}

static uint8_t take_data(struct pdi_spi *spi, uint8_t out)
{
	if (spi->command == SPI_READ || spi->command == SPI_READ_WAIT_STATE) {
		spi->is_broken |= spi->is_terminated; /* clocked on after the termination */
		spi->is_terminated = out == SPI_TERMINATION;
		return read_octet(spi);
	}
	if (spi->command == SPI_WRITE) {
		if (spi->write.len == PDI_SPI_BURST) {
			post_part(spi);
		}
		spi->write.data[spi->write.len++] = out;
	} else {
		spi->is_broken = 1;
	}
	return 0;
}

static int is_header(const struct pdi_spi *spi)
{
	return spi->pos < ADDRESS_OCTETS || (spi->pos == ADDRESS_OCTETS && spi->data_pos == 0);
}

static void clock_octets(struct pdi_spi *spi, size_t count)
{
	uint64_t tenths = spi->tenths + (uint64_t)count * PDI_SPI_OCTET_TENTH_NS;

	spi->octets += count;
	spi->pos += (unsigned)count;
	spi->now_ns += (int64_t)(tenths / 10);
	spi->tenths = (uint32_t)(tenths % 10);
}

static uint8_t transfer(struct pdi_spi *spi, uint8_t out)
{
	uint8_t in = 0;

	if (!spi->is_selected || spi->is_broken) {
		in = 0xff; /* MISO is pulled up */
	} else if (is_header(spi)) {
		in = take_address(spi, out);
	} else if (spi->pos >= spi->data_pos) {
		in = take_data(spi, out);
	}
	clock_octets(spi, 1);
	return in;
}

void pdi_spi_exchange(struct pdi_spi *spi, const uint8_t *out, uint8_t *in, size_t len)
{
	for (size_t i = 0; i < len; i++) {
		uint8_t got = transfer(spi, out[i]);

		if (in != NULL) {
			in[i] = got;
		}
	}
}

/* A read that is not terminated has already fetched the next octet, with all that reading it does.
 */
static void end_read(struct pdi_spi *spi)
{
	if (spi->pos > spi->data_pos && !spi->is_terminated) {
		(void)read_octet(spi);
		spi->is_broken = 1;
	}
}

void pdi_spi_deselect(struct pdi_spi *spi)
{
	uint8_t *errors = &spi->esc->reg[ESC_REG_PDI_ERROR];

	if (spi->is_selected && !spi->is_broken) {
		spi->is_broken = spi->data_pos == 0; /* not even an address */
		if (spi->command == SPI_READ || spi->command == SPI_READ_WAIT_STATE) {
			end_read(spi);
		} else if (spi->command == SPI_WRITE) {
			post_part(spi);
		}
	}
	if (spi->is_selected && spi->is_broken && *errors < UINT8_MAX) {
		(*errors)++;
	}
	spi->is_selected = 0;
}

/* --- an access as firmware makes them, where that is the same as octet by octet --- */

/* Select and the three octets of the address, which are those of a whole access. */
static int64_t begin_whole(struct pdi_spi *spi, uint8_t *address)
{
	pdi_spi_settle(spi, spi->now_ns);
	esc_pdi_read_al_event(spi->esc, spi->now_ns, address);
	clock_octets(spi, ADDRESS_OCTETS + 1);
	return spi->now_ns;
}

/* RAM is the same at all octets, and the ESC's watchdog is fed by the last one. */
static int can_read_whole(uint16_t address, const uint8_t *out, size_t len)
{
	int is_same = is_time(address) ? len <= TIME_OCTETS
				       : len == 1 || (address >= ESC_REG_PROCESS_RAM &&
						      address + len <= UINT16_MAX);

	return is_same && out[len - 1] == SPI_TERMINATION &&
	       memchr(out, SPI_TERMINATION, len - 1) == NULL;
}

static void read_whole(struct pdi_spi *spi, uint16_t address, uint8_t *in, size_t len)
{
	clock_octets(spi, 1);
	if (is_time(address)) {
		uint8_t time[TIME_OCTETS];

		esc_pdi_read(spi->esc, spi->now_ns, address, time, sizeof(time));
		memcpy(in, time, len);
		clock_octets(spi, len);
		return;
	}
	clock_octets(spi, len - 1);
	esc_pdi_read(spi->esc, spi->now_ns, address, in, len);
	clock_octets(spi, 1);
}

int64_t pdi_spi_access(struct pdi_spi *spi, uint8_t *address, size_t address_len,
		       const uint8_t *out, uint8_t *in, size_t len)
{
	static const uint8_t wait_state = 0xff;
	int is_usual = !spi->is_selected && address_len == ADDRESS_OCTETS + 1 && len > 0 &&
		       (address[1] & 7) == SPI_ADDRESS_EXTENSION && (address[2] & 3) == 0;
	unsigned command = is_usual ? address[2] >> 2 & 7u : SPI_NOP;
	uint16_t start = 0;
	int64_t addressed_ns;

	if (is_usual) {
		start = (uint16_t)(address[0] << 5 | address[1] >> 3 | (address[2] >> 5) << 13);
	}
	if (command == SPI_READ_WAIT_STATE && in != NULL && can_read_whole(start, out, len)) {
		addressed_ns = begin_whole(spi, address);
		read_whole(spi, start, in, len);
		return addressed_ns;
	}
	if (command == SPI_WRITE && in == NULL && len <= PDI_SPI_BURST) {
		addressed_ns = begin_whole(spi, address);
		clock_octets(spi, len);
		post(spi, start, out, len);
		return addressed_ns;
	}
	pdi_spi_select(spi);
	pdi_spi_exchange(spi, address, address, address_len);
	addressed_ns = spi->now_ns;
	pdi_spi_exchange(spi, &wait_state, NULL, in != NULL);
	pdi_spi_exchange(spi, out, in, len);
	pdi_spi_deselect(spi);
	return addressed_ns;
}
