/* SPDX-License-Identifier: MIT */
/* Writing, reloading and owning the EEPROM. */
#include "base/bytes.h"
#include "bench.h"
#include "devices/catalogue.h"
#include "harness/test.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum {
	ONE = BENCH_STATION,
	MS = 1000000,
	READ = 0x0100,
	WRITE = 0x0201,
	RELOAD = 0x0400,
	BUSY = 0x8000,
	WRITE_ERROR = 0x4000,
	COMMAND_ERROR = 0x2000,
	NOT_LOADED = 0x1000,
	CHECKSUM_ERROR = 0x0800,
	ALIAS_WORD = 4,
	CHECKSUM_WORD = 7,
};

static uint16_t command(struct bench *b, uint16_t control, uint16_t word)
{
	uint8_t bytes[6] = { 0 };

	put_le16(bytes, control);
	put_le16(bytes + 2, word);
	return bench_send(b, ECAT_CMD_FPWR, ONE, ESC_REG_EEPROM_CONTROL, bytes, sizeof(bytes));
}

static uint16_t status(struct bench *b)
{
	return bench_read16(b, ONE, ESC_REG_EEPROM_CONTROL);
}

static void write_word(struct bench *b, uint16_t word, uint16_t value)
{
	bench_write16(b, ONE, ESC_REG_EEPROM_DATA, value);
	CHECK_EQ(command(b, WRITE, word), 1);
	bench_wait(b, 10 * MS);
	CHECK_EQ(status(b) & (BUSY | WRITE_ERROR | COMMAND_ERROR), 0);
}

static uint32_t read_words(struct bench *b, uint16_t word)
{
	CHECK_EQ(command(b, READ, word), 1);
	bench_wait(b, 2 * MS);
	CHECK_EQ(status(b) & BUSY, 0);
	return bench_read32(b, ONE, ESC_REG_EEPROM_DATA);
}

/* Word 4 changed, and the checksum with it. */
static void write_alias(struct bench *b, uint16_t alias)
{
	uint8_t head[16] = { 5, 0x0c };

	head[3] = 0x06;
	put_le16(head + 4, 5000);
	put_le16(head + 8, alias);
	write_word(b, ALIAS_WORD, alias);
	write_word(b, CHECKSUM_WORD, sii_checksum(head));
}

TEST(eeprom_commands, a_word_that_was_written_is_read_back)
{
	struct bench *b = bench_create_one();

	write_word(b, 0x40, 0xbeef);
	CHECK_EQ(read_words(b, 0x40) & 0xffff, 0xbeef);
	CHECK_EQ(read_words(b, 0x3f) >> 16, 0xbeef);
	bench_destroy(b);
}

TEST(eeprom_commands, the_enable_bit_counts_for_one_command)
{
	struct bench *b = bench_create_one();

	write_word(b, 0x40, 0x1234);
	CHECK_EQ(status(b) & 1, 0);
	bench_write16(b, ONE, ESC_REG_EEPROM_DATA, 0x5678);
	CHECK_EQ(command(b, WRITE & ~1, 0x40), 1);
	CHECK_EQ(status(b) & WRITE_ERROR, WRITE_ERROR);
	CHECK_EQ(command(b, 0, 0), 1); /* command 0 clears the error */
	CHECK_EQ(status(b) & WRITE_ERROR, 0);
	CHECK_EQ(read_words(b, 0x40) & 0xffff, 0x1234);
	bench_destroy(b);
}

TEST(eeprom_commands, unknown_commands_and_words_beyond_the_end_are_errors)
{
	struct bench *b = bench_create_one();

	CHECK_EQ(command(b, 0x0700, 0), 1);
	CHECK_EQ(status(b) & (BUSY | COMMAND_ERROR), COMMAND_ERROR);
	CHECK_EQ(command(b, WRITE, 0x7000), 1);
	bench_wait(b, 10 * MS);
	CHECK_EQ(status(b) & (BUSY | COMMAND_ERROR), COMMAND_ERROR);
	CHECK_EQ(command(b, READ, 0x40), 1);
	CHECK_EQ(status(b) & COMMAND_ERROR, 0);
	bench_destroy(b);
}

TEST(eeprom_commands, a_new_alias_counts_after_a_power_cycle_only)
{
	struct bench *b = bench_create_one();
	uint8_t data[2];

	write_alias(b, 0x0777);
	CHECK_EQ(command(b, RELOAD, 0), 1);
	bench_wait(b, 5 * MS);
	CHECK_EQ(status(b) & (BUSY | NOT_LOADED | CHECKSUM_ERROR), 0);
	CHECK_EQ(bench_read16(b, ONE, ESC_REG_STATION_ALIAS), 0);
	segment_power_off(b->segment, 0, b->now_ns);
	segment_power_on(b->segment, 0, b->now_ns);
	bench_wait(b, 10 * MS);
	CHECK_EQ(bench_send(b, ECAT_CMD_APRD, 0, ESC_REG_STATION_ALIAS, data, 2), 1);
	CHECK_EQ(get_le16(data), 0x0777);
	bench_destroy(b);
}

TEST(eeprom_commands, a_reload_with_a_wrong_checksum_says_so_and_leaves_the_pdi_alive)
{
	struct bench *b = bench_create_one();

	write_word(b, ALIAS_WORD, 0x0777);
	CHECK_EQ(command(b, RELOAD, 0), 1);
	bench_wait(b, 5 * MS);
	CHECK_EQ(status(b) & (CHECKSUM_ERROR | NOT_LOADED), CHECKSUM_ERROR);
	CHECK_EQ(esc_eeprom_loaded(segment_esc(b->segment, 0)), 1);
	bench_destroy(b);
}

TEST(eeprom_commands, a_chip_that_reads_4_bytes_gives_4)
{
	const struct esc_features *lan9252 = catalogue_features(9, 0x9252);
	struct bench *b =
		bench_create(&(struct bench_slave){ .features = lan9252, .pdi = 0x80 }, 1);
	uint8_t data[8] = { 0 };

	CHECK_EQ(status(b), 0x0080);
	CHECK_EQ(command(b, READ, 8), 1);
	bench_wait(b, MS / 2);
	CHECK_EQ(status(b), 0x0080);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, ONE, ESC_REG_EEPROM_DATA, data, 8), 1);
	CHECK_EQ(get_le32(data), 0x1234);
	CHECK_EQ(get_le32(data + 4), 0);
	bench_destroy(b);
}
