/* SPDX-License-Identifier: MIT */
/* The modelled SPI pins, driven by hand: what the ET1100's data sheet lets a master do and what
 * not. */
#include "devices/pdi_spi.h"

#include "base/bytes.h"
#include "firmware/fb1111_piccolo/host/sii.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum { LOADED_NS = 5000000 };

struct pins {
	struct esc esc;
	struct pdi_spi spi;
	uint8_t sii[2048];
};

static void begin(struct pins *p)
{
	CHECK_EQ(fb1111_piccolo_sii(p->sii, sizeof(p->sii)), sizeof(p->sii));
	esc_init(&p->esc, &esc_et1100, p->sii, sizeof(p->sii), 0);
	esc_advance(&p->esc, LOADED_NS);
	CHECK(esc_eeprom_loaded(&p->esc));
	pdi_spi_init(&p->spi, &p->esc, LOADED_NS);
}

static void octets(struct pins *p, const uint8_t *out, uint8_t *in, size_t len)
{
	pdi_spi_select(&p->spi);
	for (size_t i = 0; i < len; i++) {
		in[i] = pdi_spi_transfer(&p->spi, out[i]);
	}
	pdi_spi_deselect(&p->spi);
}

static unsigned errors(const struct pins *p)
{
	return p->esc.reg[ESC_REG_PDI_ERROR];
}

TEST(pdi_spi, three_byte_addressing_reads_after_a_wait_state)
{
	/* 0x1f85: A[12:5] = 0xfc, A[4:0] = 5, A[15:13] = 0 */
	static const uint8_t out[6] = { 0xfc, 5 << 3 | 6, 0 << 5 | 3 << 2, 0xff, 0x00, 0xff };
	static struct pins p;
	uint8_t in[6];

	begin(&p);
	p.esc.ram[0xf85] = 0xa1;
	p.esc.ram[0xf86] = 0xb2;
	p.esc.al_event = 0x030201;
	octets(&p, out, in, 6);
	CHECK_EQ(in[0], 0x01);
	CHECK_EQ(in[1], 0x02);
	CHECK_EQ(in[2], 0x03);
	CHECK_EQ(in[4], 0xa1);
	CHECK_EQ(in[5], 0xb2);
	CHECK_EQ(errors(&p), 0);
	CHECK_EQ(p.spi.now_ns, LOADED_NS + 4798); /* 6 * 799.7 ns */
}

TEST(pdi_spi, two_byte_addressing_and_no_wait_state_work_as_well)
{
	static const uint8_t read[3] = { 0x0140 >> 5, 2, 0xff };
	static const uint8_t nop[2] = { 0, 0 };
	static struct pins p;
	uint8_t in[3];

	begin(&p);
	octets(&p, read, in, 3);
	CHECK_EQ(in[2], 0x05);
	octets(&p, nop, in, 2);
	CHECK_EQ(errors(&p), 0);
}

TEST(pdi_spi, a_write_reaches_the_esc_when_its_last_octet_is_clocked)
{
	static const uint8_t out[5] = { 0x80, 6, 4 << 2, 0x11, 0x22 }; /* 0x1000 */
	static struct pins p;
	uint8_t in[5];

	begin(&p);
	octets(&p, out, in, 5);
	CHECK_EQ(p.esc.ram[0], 0);
	CHECK_EQ(pdi_spi_due_ns(&p.spi), LOADED_NS + 3998);
	pdi_spi_settle(&p.spi, LOADED_NS + 3997);
	CHECK_EQ(p.esc.ram[0], 0);
	pdi_spi_settle(&p.spi, LOADED_NS + 3998);
	CHECK_EQ(p.esc.ram[0], 0x11);
	CHECK_EQ(p.esc.ram[1], 0x22);
	CHECK_EQ(pdi_spi_due_ns(&p.spi), INT64_MAX);
}

TEST(pdi_spi, a_later_access_finds_earlier_writes_done)
{
	static const uint8_t write[4] = { 0x80, 6, 4 << 2, 0x77 };
	static const uint8_t read[5] = { 0x80, 6, 3 << 2, 0xff, 0xff };
	static struct pins p;
	uint8_t in[5];

	begin(&p);
	octets(&p, write, in, 4);
	octets(&p, read, in, 5);
	CHECK_EQ(in[4], 0x77);
}

TEST(pdi_spi, a_long_write_and_many_writes_lose_nothing)
{
	static struct pins p;
	uint8_t out[3 + 100] = { 0x80, 6, 4 << 2 };
	uint8_t in[103];

	begin(&p);
	for (unsigned i = 0; i < 100; i++) {
		out[3 + i] = (uint8_t)(i + 1);
	}
	octets(&p, out, in, sizeof(out));
	pdi_spi_settle(&p.spi, INT64_MAX);
	CHECK_MEM(p.esc.ram, out + 3, 100);
	for (unsigned i = 0; i < 3u * PDI_SPI_POSTED; i++) {
		out[0] = (uint8_t)(0x80 + i);
		out[3] = (uint8_t)(0x40 + i);
		octets(&p, out, in, 4);
	}
	pdi_spi_settle(&p.spi, INT64_MAX);
	for (unsigned i = 0; i < 3u * PDI_SPI_POSTED; i++) {
		CHECK_EQ(p.esc.ram[32 * i], 0x40 + i);
	}
}

TEST(pdi_spi, a_read_that_is_not_terminated_fetches_one_more_and_is_counted)
{
	/* 0x011f, one octet, ended with 0x00: 0x0120 is fetched, which acknowledges AL control */
	static const uint8_t out[5] = { 0x011f >> 5, 0x1f << 3 | 6, 3 << 2, 0xff, 0x00 };
	static struct pins p;
	uint8_t in[5];

	begin(&p);
	p.esc.al_event = ESC_AL_EVENT_CONTROL;
	octets(&p, out, in, 5);
	CHECK_EQ(errors(&p), 1);
	CHECK_EQ(p.esc.al_event, 0);
}

TEST(pdi_spi, breaches_of_the_protocol_are_counted_and_change_nothing)
{
	static const uint8_t beyond[6] = { 0x80, 6, 3 << 2, 0xff, 0xff, 0xff };
	static const uint8_t reserved[3] = { 0x80, 1, 0 };
	static const uint8_t filler[4] = { 0x80, 6, 4 << 2 | 1, 0x55 };
	static const uint8_t short_one[1] = { 0x80 };
	static const uint8_t nop_data[3] = { 0, 0, 0x55 };
	static struct pins p;
	uint8_t in[6];

	begin(&p);
	octets(&p, beyond, in, 6);
	CHECK_EQ(errors(&p), 1);
	octets(&p, reserved, in, 3);
	CHECK_EQ(errors(&p), 2);
	octets(&p, filler, in, 4);
	CHECK_EQ(errors(&p), 3);
	octets(&p, short_one, in, 1);
	CHECK_EQ(errors(&p), 4);
	octets(&p, nop_data, in, 3);
	CHECK_EQ(errors(&p), 5);
	pdi_spi_select(&p.spi);
	octets(&p, beyond, in, 0);
	CHECK_EQ(errors(&p), 6);
	CHECK_EQ(pdi_spi_transfer(&p.spi, 0x12), 0xff); /* not selected */
	pdi_spi_settle(&p.spi, INT64_MAX);
	CHECK_EQ(p.esc.ram[0], 0);
	for (unsigned i = 0; i < 300; i++) {
		octets(&p, short_one, in, 1);
	}
	CHECK_EQ(errors(&p), 0xff);
}

TEST(pdi_spi, a_dc_time_is_read_as_one_moment)
{
	static const uint8_t out[12] = { 0x0910 >> 5, 0x10 << 3 | 6, 3 << 2, 0xff, 0, 0, 0, 0, 0, 0,
					 0,           0xff };
	static struct pins p;
	uint8_t in[12];
	uint64_t time;

	begin(&p);
	/* a carry through all octets happens while they are clocked */
	esc_clock_start(&p.esc, LOADED_NS, UINT64_C(0x00ffffffffffffff) - 4000, 0.0);
	octets(&p, out, in, 12);
	time = get_le64(in + 4);
	CHECK(time > UINT64_C(0x00ffffffffffffff) - 4000);
	CHECK(time < UINT64_C(0x00ffffffffffffff));
}
