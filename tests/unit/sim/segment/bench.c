/* SPDX-License-Identifier: MIT */
#include "bench.h"

#include "base/bytes.h"
#include "harness/test.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum { SETTLE_NS = 10000000, PDI_SPI = 0x05, BOTH_DC_UNITS = 0x0c };

static void make_sii(uint8_t *sii, const struct bench_slave *s)
{
	memset(sii, 0, BENCH_SII_BYTES);
	sii[0] = s->pdi;
	sii[1] = s->config;
	sii[3] = s->sync_pins;
	put_le16(sii + 4, 5000);
	put_le16(sii + 8, s->alias);
	sii[14] = (uint8_t)(sii_checksum(sii) ^ s->no_eeprom);
	put_le32(sii + 0x10, 0x1234);
	put_le16(sii + SII_CATEGORIES_BYTE, SII_CATEGORY_END);
}

struct bench *bench_create(const struct bench_slave *slaves, unsigned count)
{
	struct segment_slave_spec spec[BENCH_SLAVES] = { 0 };
	struct bench *b = calloc(1, sizeof(*b));

	CHECK(b != NULL);
	CHECK(count <= BENCH_SLAVES);
	for (unsigned i = 0; i < count; i++) {
		const struct bench_slave *s = &slaves[i];

		make_sii(b->sii[i], s);
		spec[i] = (struct segment_slave_spec){
			.features = s->features != NULL ? s->features : &esc_et1100,
			.sii = b->sii[i],
			.sii_bytes = BENCH_SII_BYTES,
			.device = s->device,
			.ppm = s->ppm,
			.clock_start_ns = s->clock_ns,
			.parent = (int)i - 1,
			.parent_port = 1,
			.wire_ns = 5,
			.processing_ns = 150,
			.forwarding_ns = 140,
		};
	}
	CHECK_EQ(segment_create(spec, count, 0, &b->segment), 0);
	bench_wait(b, SETTLE_NS);
	for (unsigned i = 0; i < count; i++) {
		uint8_t address[2];

		put_le16(address, (uint16_t)(BENCH_STATION + i));
		CHECK_EQ(bench_send(b, ECAT_CMD_APWR, (uint16_t)-i, ESC_REG_STATION_ADDRESS,
				    address, 2),
			 1);
	}
	return b;
}

struct bench *bench_create_one(void)
{
	return bench_create(
		&(struct bench_slave){ .pdi = PDI_SPI, .config = BOTH_DC_UNITS, .sync_pins = 0x06 },
		1);
}

void bench_destroy(struct bench *b)
{
	segment_destroy(b->segment);
	free(b);
}

static uint16_t send(struct bench *b, enum ecat_cmd cmd, uint16_t adp, uint16_t ado, uint8_t *data,
		     uint16_t len)
{
	static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };
	struct ecat_frame_builder fb;
	struct ecat_datagram dg;
	size_t pos = 0;
	uint8_t *body;

	ecat_frame_begin(&fb, b->frame, source);
	body = ecat_frame_add(&fb, cmd, 0, adp, ado, len);
	CHECK(body != NULL);
	memcpy(body, data, len);
	b->frame_len = ecat_frame_end(&fb);
	b->now_ns += BENCH_STEP_NS;
	CHECK_EQ(segment_frame(b->segment, b->now_ns, b->frame, b->frame_len, &b->back_ns), 0);
	CHECK_EQ(ecat_frame_next(b->frame, b->frame_len, &pos, &dg), 1);
	CHECK_EQ(dg.data_len, len);
	memcpy(data, dg.data, len);
	b->irq = dg.irq;
	b->adp = dg.adp;
	return get_le16(dg.wkc);
}

uint16_t bench_send(struct bench *b, enum ecat_cmd cmd, uint16_t adp, uint16_t ado, void *data,
		    uint16_t len)
{
	return send(b, cmd, adp, ado, data, len);
}

uint16_t bench_logical(struct bench *b, enum ecat_cmd cmd, uint32_t address, void *data,
		       uint16_t len)
{
	return send(b, cmd, (uint16_t)address, (uint16_t)(address >> 16), data, len);
}

static void write_bytes(struct bench *b, uint16_t station, uint16_t ado, uint64_t value,
			uint16_t len)
{
	uint8_t bytes[8];

	put_le64(bytes, value);
	CHECK_EQ(send(b, ECAT_CMD_FPWR, station, ado, bytes, len), 1);
}

static uint64_t read_bytes(struct bench *b, uint16_t station, uint16_t ado, uint16_t len)
{
	uint8_t bytes[8] = { 0 };

	CHECK_EQ(send(b, ECAT_CMD_FPRD, station, ado, bytes, len), 1);
	return get_le64(bytes);
}

void bench_write8(struct bench *b, uint16_t station, uint16_t ado, uint8_t value)
{
	write_bytes(b, station, ado, value, 1);
}

void bench_write16(struct bench *b, uint16_t station, uint16_t ado, uint16_t value)
{
	write_bytes(b, station, ado, value, 2);
}

void bench_write32(struct bench *b, uint16_t station, uint16_t ado, uint32_t value)
{
	write_bytes(b, station, ado, value, 4);
}

void bench_write64(struct bench *b, uint16_t station, uint16_t ado, uint64_t value)
{
	write_bytes(b, station, ado, value, 8);
}

uint8_t bench_read8(struct bench *b, uint16_t station, uint16_t ado)
{
	return (uint8_t)read_bytes(b, station, ado, 1);
}

uint16_t bench_read16(struct bench *b, uint16_t station, uint16_t ado)
{
	return (uint16_t)read_bytes(b, station, ado, 2);
}

uint32_t bench_read32(struct bench *b, uint16_t station, uint16_t ado)
{
	return (uint32_t)read_bytes(b, station, ado, 4);
}

uint64_t bench_read64(struct bench *b, uint16_t station, uint16_t ado)
{
	return read_bytes(b, station, ado, 8);
}

void bench_sm(struct bench *b, uint16_t station, unsigned n, uint16_t start, uint16_t len,
	      uint8_t control)
{
	uint8_t r[ESC_SM_BYTES] = { [4] = control, [6] = 1 };

	put_le16(r, start);
	put_le16(r + 2, len);
	CHECK_EQ(send(b, ECAT_CMD_FPWR, station, (uint16_t)(ESC_REG_SM + n * ESC_SM_BYTES), r,
		      sizeof(r)),
		 1);
}

void bench_fmmu(struct bench *b, uint16_t station, unsigned n, uint32_t logical, uint16_t len,
		uint16_t physical, uint8_t type)
{
	uint8_t r[ESC_FMMU_BYTES] = { [7] = 7, [11] = type, [12] = 1 };

	put_le32(r, logical);
	put_le16(r + 4, len);
	put_le16(r + 8, physical);
	CHECK_EQ(send(b, ECAT_CMD_FPWR, station, (uint16_t)(ESC_REG_FMMU + n * ESC_FMMU_BYTES), r,
		      sizeof(r)),
		 1);
}

void bench_pdi_read(struct bench *b, unsigned slave, uint16_t addr, void *buf, size_t len)
{
	esc_pdi_read(segment_esc(b->segment, slave), b->now_ns, addr, buf, len);
}

void bench_pdi_write(struct bench *b, unsigned slave, uint16_t addr, const void *buf, size_t len)
{
	esc_pdi_write(segment_esc(b->segment, slave), b->now_ns, addr, buf, len);
}

void bench_wait(struct bench *b, int64_t span_ns)
{
	b->now_ns += span_ns;
	segment_advance(b->segment, b->now_ns);
	for (size_t i = 0; i < segment_slave_count(b->segment); i++) {
		/* The segment does not know what a test has done at the PDI. */
		esc_advance(segment_esc(b->segment, i), b->now_ns);
	}
}
