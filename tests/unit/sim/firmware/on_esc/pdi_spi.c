/* SPDX-License-Identifier: MIT */
/* The modelled SPI pins, driven by hand: what the ET1100's data sheet lets a master do and what
 * not. */
#include "devices/pdi_spi.h"

#include "base/bytes.h"
#include "base/prng.h"
#include "firmware/fb1111_piccolo/host/sii.h"
#include "harness/test.h"
#include "wire/datagram.h"
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
	pdi_spi_exchange(&p->spi, out, in, len);
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
	pdi_spi_exchange(&p.spi, short_one, in, 1);
	CHECK_EQ(in[0], 0xff); /* not selected */
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

/* --- whole accesses, and octet by octet --- */

/* The master sets SyncManager 2 (written by it) and 3 (read by it) up. */
static void add_sync_managers(struct pins *p)
{
	static const uint8_t sm[16] = { 0x00, 0x18, 9,  0, 0x24, 0, 1, 0,
					0x00, 0x1c, 13, 0, 0x20, 0, 1, 0 };
	static const uint8_t source[6] = { 0x10 };
	uint8_t bytes[ECAT_FRAME_MAX_BYTES];
	struct esc_frame frame = { .pu_ns = LOADED_NS };
	struct ecat_frame_builder fb;
	struct ecat_datagram dg;
	size_t pos = 0;

	ecat_frame_begin(&fb, bytes, source);
	memcpy(ecat_frame_add(&fb, ECAT_CMD_APWR, 0, 0, ESC_REG_SM + 2 * ESC_SM_BYTES, sizeof(sm)),
	       sm, sizeof(sm));
	CHECK_EQ(ecat_frame_next(bytes, ecat_frame_end(&fb), &pos, &dg), 1);
	esc_frame_begin(&p->esc);
	esc_datagram(&p->esc, &frame, &dg);
	CHECK_EQ(get_le16(dg.wkc), 1);
}

struct access {
	uint8_t out[60];
	size_t len;
	size_t address_len;
	int is_read; /* a wait state comes after the address */
};

/* An access as firmware makes them, and now and then one as it should not. */
static void random_access(struct prng *prng, struct access *a)
{
	static const uint16_t places[] = { 0x0120, 0x0220, 0x0910, 0x0990, 0x098e, 0x0440,
					   0x0f80, 0x1000, 0x17ff, 0x1800, 0x1c00, 0x2ff8 };
	unsigned place = places[prng_below(prng, sizeof(places) / sizeof(places[0]))];
	unsigned command = prng_below(prng, 3) == 0 ? 4 : 3;
	size_t len = 4 + (size_t)prng_below(prng, prng_below(prng, 2) ? 16 : sizeof(a->out) - 4);
	uint8_t *out = a->out;
	size_t least;

	place += prng_below(prng, 4) == 0 ? (unsigned)prng_below(prng, 16) : 0;
	command = prng_below(prng, 20) == 0 ? (unsigned)prng_below(prng, 8) : command;
	out[0] = (uint8_t)(place >> 5);
	out[1] = (uint8_t)((place & 0x1f) << 3 | 6);
	out[2] = (uint8_t)((place >> 13) << 5 | command << 2);
	for (size_t i = 3; i < len; i++) {
		out[i] = (uint8_t)(command == 4 ? prng_below(prng, 256) : 0);
	}
	out[len - 1] = prng_below(prng, 10) != 0 ? 0xff : out[len - 1];
	if (prng_below(prng, 20) == 0) {
		out[prng_below(prng, len)] = 0xff;
	}
	a->address_len = prng_below(prng, 20) == 0 ? 2 : 3;
	a->is_read = (command == 3) != (prng_below(prng, 20) == 0);
	if (a->is_read) {
		out[a->address_len] = 0xff;
	}
	a->len = prng_below(prng, 20) == 0 ? (size_t)prng_below(prng, len) : len;
	least = a->address_len + (a->is_read ? 1u : 0u);
	a->len = a->len < least ? least : a->len;
}

/* Returns the time at the end of the address. */
static int64_t exchange_octets(struct pins *p, const struct access *a, uint8_t *in)
{
	int64_t addressed_ns = p->spi.now_ns;

	pdi_spi_select(&p->spi);
	for (size_t i = 0; i < a->len; i++) {
		pdi_spi_exchange(&p->spi, a->out + i, in + i, 1);
		addressed_ns = i + 1 == a->address_len ? p->spi.now_ns : addressed_ns;
	}
	pdi_spi_deselect(&p->spi);
	return addressed_ns;
}

/* As the firmware does it; what it gives as the wait state comes from the model. */
static int64_t access_whole(struct pins *p, const struct access *a, uint8_t *in)
{
	size_t data = a->address_len + (a->is_read ? 1u : 0u);

	memcpy(in, a->out, a->len);
	if (a->is_read) {
		in[a->address_len] = 0;
	}
	return pdi_spi_access(&p->spi, in, a->address_len, in + data, a->is_read ? in + data : NULL,
			      a->len - data);
}

TEST(pdi_spi, whole_accesses_are_the_same_as_octets_to_the_last_bit)
{
	static struct pins whole;
	static struct pins single;
	struct prng prng = { 3 };
	uint64_t errors_seen = 0;

	begin(&whole);
	add_sync_managers(&whole);
	single = whole;
	single.esc.sii = whole.esc.sii; /* neither writes it */
	single.spi.esc = &single.esc;
	for (unsigned n = 0; n < 20000; n++) {
		struct access a;
		uint8_t in[2][sizeof(a.out)];
		size_t data;

		random_access(&prng, &a);
		CHECK_EQ(access_whole(&whole, &a, in[0]), exchange_octets(&single, &a, in[1]));
		data = a.address_len + (a.is_read ? 1u : 0u);
		CHECK_MEM(in[0], in[1], a.address_len);
		CHECK_MEM(in[0] + data, a.is_read ? in[1] + data : a.out + data, a.len - data);
		CHECK_EQ(whole.spi.now_ns, single.spi.now_ns);
		CHECK_EQ(whole.spi.tenths, single.spi.tenths);
		CHECK_EQ(whole.spi.octets, single.spi.octets);
		CHECK_EQ(pdi_spi_due_ns(&whole.spi), pdi_spi_due_ns(&single.spi));
		CHECK_EQ(errors(&whole), errors(&single));
		CHECK_MEM(&whole.esc, &single.esc, sizeof(whole.esc));
		errors_seen += errors(&whole) > 0;
		whole.esc.reg[ESC_REG_PDI_ERROR] = single.esc.reg[ESC_REG_PDI_ERROR] = 0;
	}
	CHECK(errors_seen > 100);
	CHECK(whole.esc.sm[2].completed + whole.esc.sm[3].completed > 100);
}
