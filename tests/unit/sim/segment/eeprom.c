/* SPDX-License-Identifier: MIT */
/* The EEPROM behind its registers. */
#include "base/bytes.h"
#include "bench.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum {
	BUSY = 0x8000,
	WRITE_ERROR = 0x4000,
	COMMAND_ERROR = 0x2000,
	NOT_LOADED = 0x1000,
	CHECKSUM_ERROR = 0x0800,
	READ = 0x0100,
	WRITE = 0x0200,
	RELOAD = 0x0400,
	ENABLE = 0x0001,
};

static uint16_t command(struct bench *b, uint16_t control, uint32_t word)
{
	uint8_t data[6];

	put_le16(data, control);
	put_le32(data + 2, word);
	return bench_send(b, ECAT_CMD_FPWR, BENCH_STATION, ESC_REG_EEPROM_CONTROL, data,
			  sizeof(data));
}

static uint16_t wait_idle(struct bench *b)
{
	uint16_t status = BUSY;

	for (int i = 0; (status & BUSY) && i < 200; i++) {
		status = bench_read16(b, BENCH_STATION, ESC_REG_EEPROM_CONTROL);
	}
	CHECK_EQ(status & BUSY, 0);
	return status;
}

TEST(eeprom, a_read_is_busy_for_700_us_and_then_there)
{
	struct bench *b = bench_create_one();
	int64_t asked_ns;

	CHECK_EQ(command(b, READ, 0), 1);
	asked_ns = b->now_ns;
	CHECK_EQ(bench_read16(b, BENCH_STATION, ESC_REG_EEPROM_CONTROL) & BUSY, BUSY);
	wait_idle(b);
	CHECK(b->now_ns - asked_ns > 600000 && b->now_ns - asked_ns < 900000);
	CHECK_EQ(bench_read64(b, BENCH_STATION, ESC_REG_EEPROM_DATA), get_le64(b->sii[0]));
	bench_destroy(b);
}

TEST(eeprom, while_busy_nothing_else_is_taken)
{
	struct bench *b = bench_create_one();

	CHECK_EQ(command(b, READ, 0), 1);
	(void)command(b, READ, 8);
	wait_idle(b);
	CHECK_EQ(bench_read64(b, BENCH_STATION, ESC_REG_EEPROM_DATA), get_le64(b->sii[0]));
	bench_destroy(b);
}

TEST(eeprom, beyond_its_end_it_reads_as_erased)
{
	struct bench *b = bench_create_one();

	CHECK_EQ(command(b, READ, 0x7fffffff), 1);
	CHECK_EQ(wait_idle(b) & COMMAND_ERROR, 0);
	CHECK_EQ(bench_read64(b, BENCH_STATION, ESC_REG_EEPROM_DATA), UINT64_MAX);
	bench_destroy(b);
}

TEST(eeprom, a_write_needs_its_enable_bit)
{
	struct bench *b = bench_create_one();

	bench_write16(b, BENCH_STATION, ESC_REG_EEPROM_DATA, 0xbeef);
	CHECK_EQ(command(b, WRITE, 0x20), 1);
	CHECK_EQ(wait_idle(b) & WRITE_ERROR, WRITE_ERROR);
	bench_write16(b, BENCH_STATION, ESC_REG_EEPROM_DATA, 0xbeef);
	CHECK_EQ(command(b, WRITE | ENABLE, 0x20), 1);
	CHECK_EQ(wait_idle(b) & (WRITE_ERROR | COMMAND_ERROR), 0);
	CHECK_EQ(command(b, READ, 0x20), 1);
	wait_idle(b);
	CHECK_EQ(bench_read16(b, BENCH_STATION, ESC_REG_EEPROM_DATA), 0xbeef);
	bench_destroy(b);
}

TEST(eeprom, the_pdi_gets_it_only_when_the_master_gives_it)
{
	struct bench *b = bench_create_one();
	uint8_t take[1] = { 1 };
	uint8_t read[6] = { 0, 1, 8, 0, 0, 0 };
	uint8_t data[8];

	bench_pdi_write(b, 0, ESC_REG_EEPROM_PDI_ACCESS, take, 1);
	CHECK_EQ(bench_read8(b, BENCH_STATION, ESC_REG_EEPROM_PDI_ACCESS) & 1, 0);
	bench_write8(b, BENCH_STATION, ESC_REG_EEPROM_CONFIG, 1);
	bench_pdi_write(b, 0, ESC_REG_EEPROM_PDI_ACCESS, take, 1);
	CHECK_EQ(bench_read8(b, BENCH_STATION, ESC_REG_EEPROM_PDI_ACCESS) & 1, 1);
	/* Now the master cannot. */
	CHECK_EQ(command(b, READ, 0), 0);
	bench_pdi_write(b, 0, ESC_REG_EEPROM_CONTROL, read, 6);
	bench_wait(b, 1000000);
	bench_pdi_read(b, 0, ESC_REG_EEPROM_DATA, data, 8);
	CHECK_EQ(get_le64(data), get_le64(b->sii[0] + 16));
	/* Bit 1 takes it by force. */
	bench_write8(b, BENCH_STATION, ESC_REG_EEPROM_CONFIG, 2);
	bench_write8(b, BENCH_STATION, ESC_REG_EEPROM_CONFIG, 0);
	CHECK_EQ(command(b, READ, 0), 1);
	bench_destroy(b);
}

TEST(eeprom, a_wrong_checksum_leaves_the_slave_without_its_application)
{
	struct bench *b = bench_create(&(struct bench_slave){ .pdi = 5, .no_eeprom = 1 }, 1);
	uint8_t type[1] = { 0xaa };

	CHECK_EQ(bench_read16(b, BENCH_STATION, ESC_REG_EEPROM_CONTROL) &
			 (CHECKSUM_ERROR | NOT_LOADED),
		 CHECKSUM_ERROR | NOT_LOADED);
	CHECK_EQ(esc_eeprom_loaded(segment_esc(b->segment, 0)), 0);
	CHECK_EQ(bench_read16(b, BENCH_STATION, ESC_REG_DL_STATUS) & 1, 0);
	bench_pdi_read(b, 0, ESC_REG_TYPE, type, 1);
	CHECK_EQ(type[0], 0);
	/* The master can still repair it: write the right checksum, reload. */
	bench_write16(b, BENCH_STATION, ESC_REG_EEPROM_DATA, (uint16_t)(b->sii[0][14] ^ 1));
	CHECK_EQ(command(b, WRITE | ENABLE, 7), 1);
	wait_idle(b);
	CHECK_EQ(command(b, RELOAD, 0), 1);
	CHECK_EQ(wait_idle(b) & (CHECKSUM_ERROR | NOT_LOADED), 0);
	CHECK_EQ(esc_eeprom_loaded(segment_esc(b->segment, 0)), 1);
	bench_destroy(b);
}

TEST(eeprom, configuration_is_not_there_before_it_is_loaded)
{
	struct esc esc;
	uint8_t sii[BENCH_SII_BYTES];
	struct bench *b = bench_create_one();
	uint8_t byte[1] = { 0xaa };

	memcpy(sii, b->sii[0], sizeof(sii));
	esc_init(&esc, &esc_et1100, sii, sizeof(sii), 0);
	CHECK_EQ(esc_eeprom_loaded(&esc), 0);
	esc_pdi_read(&esc, 1000, ESC_REG_TYPE, byte, 1);
	CHECK_EQ(byte[0], 0);
	esc_advance(&esc, 5000000);
	CHECK_EQ(esc_eeprom_loaded(&esc), 1);
	esc_pdi_read(&esc, 5000000, ESC_REG_TYPE, byte, 1);
	CHECK_EQ(byte[0], 0x11);
	CHECK_EQ(esc.reg[ESC_REG_PDI_CONTROL], 5);
	bench_destroy(b);
}
