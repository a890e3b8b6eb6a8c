/* SPDX-License-Identifier: MIT */
/* AL states of a slave that is only an SII. */
#include "devices/sii_device.h"
#include "base/bytes.h"
#include "harness/test.h"
#include "terminal.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { STATION = BENCH_STATION, BOX = 128, MS = 1000000 };

static void send_outputs(struct bench *b)
{
	uint8_t outputs[TERMINAL_OUTPUT_BYTES] = { 0 };

	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, STATION, TERMINAL_OUTPUTS, outputs, sizeof(outputs)),
		 1);
}

TEST(sii_device, preop_needs_its_mailboxes)
{
	struct bench *b = terminal_create(BOX);

	CHECK_EQ(terminal_request(b, AL_PREOP), AL_INIT | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_INVALID_MAILBOX_CONFIG);
	/* An error counts until it is acknowledged; INIT needs no acknowledge. */
	CHECK_EQ(terminal_request(b, AL_PREOP), AL_INIT | AL_ERROR);
	CHECK_EQ(terminal_request(b, AL_INIT), AL_INIT);
	terminal_to_preop(b, BOX);
	bench_destroy(b);
}

TEST(sii_device, states_cannot_be_skipped_and_unknown_ones_are_refused)
{
	struct bench *b = terminal_create(BOX);

	CHECK_EQ(terminal_request(b, AL_SAFEOP), AL_INIT | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_INVALID_STATE_CHANGE);
	CHECK_EQ(terminal_request(b, AL_INIT | AL_ERROR), AL_INIT);
	terminal_to_preop(b, BOX);
	CHECK_EQ(terminal_request(b, AL_OP), AL_PREOP | AL_ERROR);
	CHECK_EQ(terminal_request(b, AL_PREOP | AL_ERROR), AL_PREOP);
	CHECK_EQ(terminal_request(b, AL_BOOT), AL_PREOP | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_INVALID_STATE_CHANGE);
	CHECK_EQ(terminal_request(b, 7 | AL_ERROR), AL_PREOP | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_UNKNOWN_STATE);
	bench_destroy(b);
}

TEST(sii_device, safeop_needs_process_data_of_the_right_length)
{
	struct bench *b = terminal_create(BOX);

	terminal_to_preop(b, BOX);
	bench_sm(b, STATION, 2, TERMINAL_OUTPUTS, TERMINAL_OUTPUT_BYTES + 1, 0x64);
	CHECK_EQ(terminal_request(b, AL_SAFEOP), AL_PREOP | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_INVALID_OUTPUT_CONFIG);
	CHECK_EQ(terminal_request(b, AL_PREOP | AL_ERROR), AL_PREOP);
	bench_write8(b, STATION, ESC_REG_SM + 2 * ESC_SM_BYTES + 6, 0);
	terminal_to_safeop(b);
	bench_destroy(b);
}

TEST(sii_device, inputs_change_from_safeop_on)
{
	struct bench *b = terminal_create(BOX);
	uint8_t first[TERMINAL_INPUT_BYTES];
	uint8_t second[TERMINAL_INPUT_BYTES];

	terminal_to_preop(b, BOX);
	terminal_to_safeop(b);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, STATION, TERMINAL_INPUTS, first, sizeof(first)), 1);
	bench_wait(b, 5 * MS);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, STATION, TERMINAL_INPUTS, second, sizeof(second)), 1);
	CHECK(get_le32(second) > get_le32(first));
	bench_destroy(b);
}

TEST(sii_device, op_without_outputs_falls_back_with_001b)
{
	struct bench *b = terminal_create(BOX);

	terminal_to_preop(b, BOX);
	terminal_to_safeop(b);
	CHECK_EQ(terminal_request(b, AL_OP), AL_SAFEOP | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_SM_WATCHDOG);
	bench_destroy(b);
}

TEST(sii_device, outputs_that_stop_in_op_bring_it_to_safeop_after_100_ms)
{
	struct bench *b = terminal_create(BOX);

	terminal_to_preop(b, BOX);
	terminal_to_safeop(b);
	send_outputs(b);
	CHECK_EQ(terminal_request(b, AL_OP), AL_OP);
	for (int i = 0; i < 50; i++) {
		send_outputs(b);
		bench_wait(b, 10 * MS);
	}
	CHECK_EQ(bench_read16(b, STATION, ESC_REG_AL_STATUS), AL_OP);
	bench_wait(b, 89 * MS);
	CHECK_EQ(bench_read16(b, STATION, ESC_REG_AL_STATUS), AL_OP);
	bench_wait(b, 2 * MS);
	CHECK_EQ(bench_read16(b, STATION, ESC_REG_AL_STATUS), AL_SAFEOP | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_SM_WATCHDOG);
	bench_destroy(b);
}

TEST(sii_device, a_switched_off_watchdog_never_bites)
{
	struct bench *b = terminal_create(BOX);

	bench_write16(b, STATION, ESC_REG_WATCHDOG_TIME_PD, 0);
	terminal_to_preop(b, BOX);
	terminal_to_safeop(b);
	CHECK_EQ(terminal_request(b, AL_OP), AL_OP);
	bench_wait(b, 1000 * MS);
	CHECK_EQ(bench_read16(b, STATION, ESC_REG_AL_STATUS), AL_OP);
	bench_destroy(b);
}

TEST(sii_device, with_device_emulation_the_chip_does_the_states_alone)
{
	uint8_t sii[TERMINAL_SII_BYTES];
	size_t bytes = terminal_sii(sii, "");
	struct bench_slave slave = { .pdi = 4, .config = 1 };
	struct bench *b;

	slave.device = sii_device_create(sii, bytes);
	b = bench_create(&slave, 1);
	bench_write16(b, STATION, ESC_REG_AL_CONTROL, AL_OP);
	CHECK_EQ(bench_read16(b, STATION, ESC_REG_AL_STATUS), AL_OP);
	bench_wait(b, 1000 * MS);
	CHECK_EQ(bench_read16(b, STATION, ESC_REG_AL_STATUS), AL_OP);
	bench_destroy(b);
}

/* A master may write to it while its EEPROM is still being loaded. */
TEST(sii_device, with_device_emulation_a_request_before_the_eeprom_is_loaded_locks_nothing)
{
	uint8_t sii[TERMINAL_SII_BYTES];
	size_t bytes = terminal_sii(sii, "");
	struct bench_slave slave = { .pdi = 4, .config = 1 };
	uint8_t init[2] = { AL_INIT };
	uint8_t preop[2] = { AL_PREOP };
	uint8_t status[2];
	struct bench *b;

	slave.device = sii_device_create(sii, bytes);
	b = bench_create(&slave, 1);
	bench_write8(b, STATION, ESC_REG_RESET_ECAT, 'R');
	bench_write8(b, STATION, ESC_REG_RESET_ECAT, 'E');
	bench_write8(b, STATION, ESC_REG_RESET_ECAT, 'S');
	CHECK_EQ(bench_send(b, ECAT_CMD_APWR, 0, ESC_REG_AL_CONTROL, init, sizeof(init)), 1);
	CHECK_EQ(esc_eeprom_loaded(segment_esc(b->segment, 0)), 0);
	bench_wait(b, 5 * MS);
	CHECK_EQ(esc_eeprom_loaded(segment_esc(b->segment, 0)), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_APWR, 0, ESC_REG_AL_CONTROL, preop, sizeof(preop)), 1);
	CHECK_EQ(bench_send(b, ECAT_CMD_APRD, 0, ESC_REG_AL_STATUS, status, sizeof(status)), 1);
	CHECK_EQ(status[0], AL_PREOP);
	bench_destroy(b);
}

TEST(sii_device, images_without_sense_are_slaves_too)
{
	uint8_t sii[TERMINAL_SII_BYTES];
	size_t whole = terminal_sii(sii, "Cut off");

	for (size_t bytes = 0; bytes < whole; bytes += 7) {
		struct bench_slave slave = { .pdi = 5, .device = sii_device_create(sii, bytes) };
		struct bench *b = bench_create(&slave, 1);

		bench_sm(b, STATION, 0, TERMINAL_MAILBOX_OUT, BOX, 0x26);
		bench_sm(b, STATION, 1, TERMINAL_MAILBOX_IN, BOX, 0x22);
		CHECK_EQ(terminal_request(b, AL_PREOP), AL_PREOP);
		bench_destroy(b);
	}
}
