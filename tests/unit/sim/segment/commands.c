/* SPDX-License-Identifier: MIT */
/* The fifteen commands: who takes part, what moves, what counts. */
#include "bench.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum { RAM = 0x1000 };

static struct bench *two(void)
{
	const struct bench_slave slaves[] = {
		{ .pdi = 5, .config = 0x0c, .alias = 77 },
		{ .pdi = 5, .config = 0x0c, .alias = 78 },
	};

	return bench_create(slaves, 2);
}

TEST(commands, nop_moves_nothing)
{
	struct bench *b = two();
	uint8_t data[2] = { 1, 2 };

	CHECK_EQ(bench_send(b, ECAT_CMD_NOP, 0, RAM, data, 2), 0);
	CHECK_EQ(b->adp, 0);
	CHECK_EQ(data[0], 1);
	bench_destroy(b);
}

TEST(commands, read_write_returns_what_was_there_and_counts_three)
{
	struct bench *b = two();
	uint8_t data[2] = { 0x11, 0x22 };

	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1001, RAM, data, 2), 1);
	data[0] = 0x33;
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRW, 0x1001, RAM, data, 2), 3);
	CHECK_EQ(data[0], 0x11);
	CHECK_EQ(bench_send(b, ECAT_CMD_APRW, 0xffff, RAM, data, 2), 3);
	CHECK_EQ(data[0], 0x33);
	CHECK_EQ(b->adp, 1);
	bench_destroy(b);
}

TEST(commands, broadcast_read_write_ors_and_writes_what_came_in)
{
	struct bench *b = two();
	uint8_t one[1] = { 0x01 };
	uint8_t two_bits[1] = { 0x02 };
	uint8_t data[1] = { 0x80 };

	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1000, RAM, one, 1), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1001, RAM, two_bits, 1), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_BRW, 0, RAM, data, 1), 6);
	CHECK_EQ(data[0], 0x83);
	CHECK_EQ(bench_read8(b, 0x1000, RAM), 0x80);
	/* The second slave got what the first had put into the frame. */
	CHECK_EQ(bench_read8(b, 0x1001, RAM), 0x81);
	bench_destroy(b);
}

TEST(commands, read_multiple_write_takes_from_one_and_gives_to_all_others)
{
	const struct bench_slave slaves[4] = {
		{ .pdi = 5 }, { .pdi = 5 }, { .pdi = 5 }, { .pdi = 5 }
	};
	struct bench *b = bench_create(slaves, 4);
	uint8_t data[1] = { 0x42 };

	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1001, RAM, data, 1), 1);
	data[0] = 0x99;
	CHECK_EQ(bench_send(b, ECAT_CMD_FRMW, 0x1001, RAM, data, 1), 4);
	CHECK_EQ(data[0], 0x42);
	CHECK_EQ(bench_read8(b, 0x1000, RAM), 0x99); /* before the one that is read */
	CHECK_EQ(bench_read8(b, 0x1003, RAM), 0x42);
	data[0] = 0;
	CHECK_EQ(bench_send(b, ECAT_CMD_ARMW, 0, RAM, data, 1), 4);
	CHECK_EQ(bench_read8(b, 0x1003, RAM), 0x99);
	bench_destroy(b);
}

TEST(commands, an_alias_is_an_address_once_it_is_switched_on)
{
	struct bench *b = two();
	uint8_t data[1] = { 0 };
	uint8_t on[1] = { 1 };

	CHECK_EQ(bench_read16(b, 0x1001, ESC_REG_STATION_ALIAS), 78);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 78, RAM, data, 1), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_BWR, 0, ESC_REG_DL_CONTROL + 3, on, 1), 2);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 78, RAM, data, 1), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 0x1001, RAM, data, 1), 1);
	bench_destroy(b);
}

TEST(commands, memory_beyond_the_ram_is_not_there)
{
	struct bench *b = two();
	uint8_t data[4] = { 0 };

	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 0x1000, 0x2fff, data, 1), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 0x1000, 0x3000, data, 1), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1000, 0xffff, data, 4), 0);
	bench_destroy(b);
}

TEST(commands, logical_access_counts_once_a_slave_and_direction)
{
	struct bench *b = two();
	uint8_t data[4] = { 1, 2, 3, 4 };

	bench_fmmu(b, 0x1000, 0, 0x10000, 1, RAM, 2);
	bench_fmmu(b, 0x1000, 1, 0x10001, 1, RAM + 16, 2);
	bench_fmmu(b, 0x1000, 2, 0x10002, 1, RAM, 1);
	bench_fmmu(b, 0x1001, 0, 0x10003, 1, RAM, 1);
	CHECK_EQ(bench_logical(b, ECAT_CMD_LWR, 0x10000, data, 4), 1);
	CHECK_EQ(bench_logical(b, ECAT_CMD_LRD, 0x10000, data, 4), 2);
	CHECK_EQ(data[2], 1);
	CHECK_EQ(bench_logical(b, ECAT_CMD_LRW, 0x10000, data, 4), 3 + 1);
	CHECK_EQ(bench_logical(b, ECAT_CMD_LRW, 0x10004, data, 4), 0);
	bench_destroy(b);
}

TEST(commands, an_fmmu_moves_bits_where_it_is_told)
{
	struct bench *b = two();
	uint8_t fmmu[ESC_FMMU_BYTES] = { [0] = 0x00, [4] = 2,  [6] = 6,  [7] = 1, [8] = 0x00,
					 [9] = 0x10, [10] = 3, [11] = 1, [12] = 1 };
	uint8_t memory[1] = { 0x78 }; /* bits 3 to 6 set */
	uint8_t data[2] = { 0, 0xff };

	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1000, RAM, memory, 1), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1000, ESC_REG_FMMU, fmmu, sizeof(fmmu)), 1);
	CHECK_EQ(bench_logical(b, ECAT_CMD_LRD, 0, data, 2), 1);
	/* Logical bits 6, 7, 8 and 9 come from physical bits 3 to 6; all others stay. */
	CHECK_EQ(data[0], 0xc0);
	CHECK_EQ(data[1], 0xff);
	memory[0] = 0x08;
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1000, RAM, memory, 1), 1);
	CHECK_EQ(bench_logical(b, ECAT_CMD_LRD, 0, data, 2), 1);
	CHECK_EQ(data[0], 0x40);
	CHECK_EQ(data[1], 0xfc);
	bench_destroy(b);
}

TEST(commands, digital_outputs_keep_the_bits_that_another_fmmu_wrote)
{
	struct bench *b = two();
	uint8_t low[ESC_FMMU_BYTES] = { [4] = 1, [7] = 3, [9] = 0x0f, [11] = 2, [12] = 1 };
	uint8_t high[ESC_FMMU_BYTES] = { [0] = 1,  [4] = 1,  [7] = 3, [9] = 0x0f,
					 [10] = 4, [11] = 2, [12] = 1 };
	uint8_t data[2] = { 0x05, 0x0a };

	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1000, ESC_REG_FMMU, low, sizeof(low)), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1000, ESC_REG_FMMU + 16, high, sizeof(high)), 1);
	CHECK_EQ(bench_logical(b, ECAT_CMD_LWR, 0, data, 2), 1);
	CHECK_EQ(segment_esc(b->segment, 0)->reg[0x0f00], 0xa5);
	bench_destroy(b);
}

TEST(commands, an_fmmu_of_more_bytes_than_any_frame_is_harmless)
{
	struct bench *b = two();
	uint8_t data[16] = { 0x5a };

	/* Beyond the RAM nothing is read or written, and logical addresses do not start again at 0.
	 */
	bench_fmmu(b, 0x1000, 0, 0xfffffff8, 0xffff, 0xfff0, 3);
	CHECK_EQ(bench_logical(b, ECAT_CMD_LRW, 0xfffffff0, data, 16), 0);
	CHECK_EQ(bench_logical(b, ECAT_CMD_LRW, 0, data, 16), 0);
	CHECK_EQ(data[0], 0x5a);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 0x1000, ESC_REG_AL_STATUS, data, 2), 1);
	bench_destroy(b);
}
