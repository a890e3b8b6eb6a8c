/* SPDX-License-Identifier: MIT */
/* What captures of real slaves say (the study's slave facts), one sentence each. */
#include "base/bytes.h"
#include "bench.h"
#include "devices/catalogue.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum { BECKHOFF = 2, DIGITAL_IO = 0x04, EMULATION = 0x01 };

/* EK1100 + EL2828 + EL2889, with the first bytes of their EEPROMs. */
static struct bench *real_bus(void)
{
	const struct bench_slave slaves[] = {
		{ .features = catalogue_features(BECKHOFF, 0x044c2c52),
		  .pdi = 0x00,
		  .config = 0x0d },
		{ .features = catalogue_features(BECKHOFF, 0x0b0c3052),
		  .pdi = DIGITAL_IO,
		  .config = EMULATION },
		{ .features = catalogue_features(BECKHOFF, 0x0b493052),
		  .pdi = DIGITAL_IO,
		  .config = EMULATION },
	};

	return bench_create(slaves, 3);
}

static uint16_t broadcast(struct bench *b, uint16_t ado, uint16_t len)
{
	uint8_t zeros[64] = { 0 };

	return bench_send(b, ECAT_CMD_BWR, 0, ado, zeros, len);
}

TEST(facts, returned_frames_carry_bit_1_in_the_first_octet_of_the_source)
{
	struct bench *b = real_bus();
	uint8_t data[1] = { 0 };

	bench_send(b, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1);
	CHECK_EQ(b->frame[6], 0x12);
	CHECK_EQ(b->frame[7], 0x10);
	bench_destroy(b);
}

TEST(facts, broadcast_addresses_come_back_counted_up_by_every_slave)
{
	struct bench *b = real_bus();
	uint8_t data[2] = { 0 };

	bench_send(b, ECAT_CMD_BWR, 0, ESC_REG_ECAT_EVENT_MASK, data, 2);
	CHECK_EQ(b->adp, 3);
	CHECK_EQ(bench_send(b, ECAT_CMD_APRD, 0xfffe, ESC_REG_TYPE, data, 1), 1);
	CHECK_EQ(b->adp, 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_APRD, 1, ESC_REG_TYPE, data, 1), 0);
	CHECK_EQ(b->adp, 4);
	bench_destroy(b);
}

TEST(facts, a_broadcast_read_ors_what_the_slaves_say)
{
	struct bench *b = real_bus();
	uint8_t type[1] = { 0 };

	CHECK_EQ(bench_send(b, ECAT_CMD_BRD, 0, ESC_REG_TYPE, type, 1), 3);
	CHECK_EQ(type[0], 0x13);
	bench_destroy(b);
}

TEST(facts, a_register_that_does_not_exist_gives_no_wkc)
{
	struct bench *b = real_bus();

	for (uint16_t n = 0; n < 16; n++) {
		uint16_t wanted = n < 3 ? 3 : n < 8 ? 1 : 0;

		CHECK_EQ(
			broadcast(b, (uint16_t)(ESC_REG_FMMU + n * ESC_FMMU_BYTES), ESC_FMMU_BYTES),
			wanted);
	}
	for (uint16_t n = 0; n < 16; n++) {
		uint16_t wanted = n < 4 ? 3 : n < 8 ? 1 : 0;

		CHECK_EQ(broadcast(b, (uint16_t)(ESC_REG_SM + n * ESC_SM_BYTES), ESC_SM_BYTES),
			 wanted);
	}
	bench_destroy(b);
}

TEST(facts, an_access_that_touches_one_existing_byte_counts)
{
	struct bench *b = real_bus();

	/* FMMU 2 exists everywhere, FMMU 3 in the coupler only. */
	CHECK_EQ(broadcast(b, ESC_REG_FMMU + 2 * ESC_FMMU_BYTES, 2 * ESC_FMMU_BYTES), 3);
	bench_destroy(b);
}

TEST(facts, the_difference_register_cannot_be_written)
{
	struct bench *b = real_bus();

	CHECK_EQ(broadcast(b, ESC_REG_DC_SYSTEM_TIME_DIFF, 4), 0);
	bench_destroy(b);
}

TEST(facts, a_slave_with_receive_times_only_is_passed_over_by_the_rest)
{
	struct bench *b = real_bus();
	uint8_t data[8] = { 0 };

	CHECK_EQ(broadcast(b, ESC_REG_DC_RECEIVE_TIME_PORT, 4), 3);
	CHECK_EQ(broadcast(b, ESC_REG_DC_SYSTEM_TIME, 8), 2);
	CHECK_EQ(broadcast(b, ESC_REG_DC_SYSTEM_TIME_OFFSET, 8), 2);
	CHECK_EQ(broadcast(b, ESC_REG_DC_ACTIVATION, 1), 2);
	CHECK_EQ(broadcast(b, ESC_REG_DC_SPEED_COUNTER_START, 2), 2);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 0x1001, ESC_REG_DC_SYSTEM_TIME_DIFF, data, 4), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 0x1001, ESC_REG_DC_RECEIVE_TIME_PU, data, 8), 0);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 0x1001, ESC_REG_DC_RECEIVE_TIME_PORT, data, 4), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_FRMW, 0x1000, ESC_REG_DC_SYSTEM_TIME, data, 8), 2);
	bench_destroy(b);
}

TEST(facts, receive_times_tell_the_way_to_the_tail_and_back)
{
	struct bench *b = real_bus();
	uint32_t coupler;
	uint32_t terminal;

	broadcast(b, ESC_REG_DC_RECEIVE_TIME_PORT, 4);
	coupler = bench_read32(b, 0x1000, ESC_REG_DC_RECEIVE_TIME_PORT + 4) -
		  bench_read32(b, 0x1000, ESC_REG_DC_RECEIVE_TIME_PORT);
	terminal = bench_read32(b, 0x1001, ESC_REG_DC_RECEIVE_TIME_PORT + 4) -
		   bench_read32(b, 0x1001, ESC_REG_DC_RECEIVE_TIME_PORT);
	CHECK(coupler >= 590 && coupler <= 610);
	CHECK(terminal >= 300 && terminal <= 320);
	bench_destroy(b);
}

TEST(facts, ports_that_no_frame_came_in_at_keep_leftover_bytes)
{
	struct bench *b = real_bus();
	uint8_t ports[16] = { 0 };

	broadcast(b, ESC_REG_DC_RECEIVE_TIME_PORT, 4);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 0x1002, ESC_REG_DC_RECEIVE_TIME_PORT, ports, 16), 1);
	CHECK(get_le32(ports) != 0);
	CHECK_MEM(ports + 4, "hoff\0\0\0\0Verl", 12);
	bench_destroy(b);
}

TEST(facts, lrw_of_two_output_only_slaves_gives_4)
{
	struct bench *b = real_bus();
	uint8_t data[2] = { 0x55, 0xaa };

	for (uint16_t i = 1; i <= 2; i++) {
		bench_sm(b, (uint16_t)(0x1000 + i), 0, 0x0f00, 1, 0x44);
		bench_fmmu(b, (uint16_t)(0x1000 + i), 0, i - 1u, 1, 0x0f00, 2);
	}
	CHECK_EQ(bench_logical(b, ECAT_CMD_LRW, 0, data, 2), 4);
	CHECK_EQ(data[0], 0x55);
	CHECK_EQ(segment_esc(b->segment, 1)->reg[0x0f00], 0x55);
	CHECK_EQ(segment_esc(b->segment, 2)->reg[0x0f00], 0xaa);
	bench_destroy(b);
}

TEST(facts, the_eeprom_delivers_8_bytes)
{
	struct bench *b = real_bus();
	uint8_t command[6] = { 0x00, 0x01, 0x08, 0, 0, 0 };
	uint8_t data[8] = { 0 };

	CHECK_EQ(bench_read16(b, 0x1000, ESC_REG_EEPROM_CONTROL), 0x0040);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, 0x1000, ESC_REG_EEPROM_CONTROL, command, 6), 1);
	CHECK_EQ(bench_read16(b, 0x1000, ESC_REG_EEPROM_CONTROL), 0x8140);
	bench_wait(b, 1000000);
	CHECK_EQ(bench_read16(b, 0x1000, ESC_REG_EEPROM_CONTROL), 0x0040);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, 0x1000, ESC_REG_EEPROM_DATA, data, 8), 1);
	CHECK_MEM(data, b->sii[0] + 16, 8);
	bench_destroy(b);
}

TEST(facts, a_terminal_with_device_emulation_shows_what_it_is_told)
{
	struct bench *b = real_bus();

	/* EtherCrab and SOEM ask for INIT with acknowledge first; 0x11 is read back. */
	bench_write16(b, 0x1002, ESC_REG_AL_CONTROL, 0x11);
	CHECK_EQ(bench_read16(b, 0x1002, ESC_REG_AL_STATUS), 0x11);
	bench_write16(b, 0x1002, ESC_REG_AL_CONTROL, 0x08);
	CHECK_EQ(bench_read16(b, 0x1002, ESC_REG_AL_STATUS), 0x08);
	bench_destroy(b);
}

TEST(facts, dl_status_shows_links_loops_and_whether_the_pdi_lives)
{
	struct bench *b = real_bus();

	CHECK_EQ(bench_read16(b, 0x1000, ESC_REG_DL_STATUS), 0x5a31);
	CHECK_EQ(bench_read16(b, 0x1001, ESC_REG_DL_STATUS), 0x5a33);
	CHECK_EQ(bench_read16(b, 0x1002, ESC_REG_DL_STATUS), 0x5613);
	bench_destroy(b);
}

TEST(facts, a_pending_dl_event_comes_back_in_the_irq_field_until_dl_status_is_read)
{
	struct bench *b = real_bus();
	uint8_t mask[2] = { 0x04, 0 };
	uint8_t data[2];

	CHECK_EQ(bench_send(b, ECAT_CMD_BWR, 0, ESC_REG_ECAT_EVENT_MASK, mask, 2), 3);
	CHECK_EQ(b->irq, 0); /* the field has passed before the mask */
	bench_send(b, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1);
	CHECK_EQ(b->irq, 4);
	for (uint16_t i = 0; i < 3; i++) {
		(void)bench_read16(b, (uint16_t)(0x1000 + i), ESC_REG_DL_STATUS);
	}
	bench_send(b, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1);
	CHECK_EQ(b->irq, 0);
	bench_destroy(b);
}

TEST(facts, al_control_takes_no_second_request_before_the_first_is_read)
{
	struct bench *b = bench_create_one();
	uint8_t control[2] = { 0x11, 0 };
	uint8_t read[2];

	CHECK_EQ(bench_send(b, ECAT_CMD_BWR, 0, ESC_REG_AL_CONTROL, control, 2), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_BWR, 0, ESC_REG_AL_CONTROL, control, 2), 0);
	bench_pdi_read(b, 0, ESC_REG_AL_CONTROL, read, 2);
	CHECK_EQ(read[0], 0x11);
	CHECK_EQ(bench_send(b, ECAT_CMD_BWR, 0, ESC_REG_AL_CONTROL, control, 2), 1);
	bench_destroy(b);
}
