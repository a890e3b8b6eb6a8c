/* SPDX-License-Identifier: MIT */
/* The AL state machine: every way between the states, and why a way is refused. */
#include "wire/al.h"
#include "base/bytes.h"
#include "board.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum {
	ERROR_INIT = AL_INIT | AL_ERROR,
	ERROR_PREOP = AL_PREOP | AL_ERROR,
	ERROR_SAFEOP = AL_SAFEOP | AL_ERROR
};

static void expect(struct board *b, uint16_t control, uint16_t status, uint16_t code)
{
	CHECK_EQ(board_master_request(b, control), status);
	CHECK_EQ(board_al_code(b), code);
	CHECK_EQ(board_breaches(b), 0);
}

TEST(firmware, walks_up_and_down_all_states)
{
	struct board b;

	board_lead_to(&b, PICCOLO_OP);
	expect(&b, AL_SAFEOP, AL_SAFEOP, 0);
	expect(&b, AL_PREOP, AL_PREOP, 0);
	expect(&b, AL_SAFEOP, AL_SAFEOP, 0);
	expect(&b, AL_INIT, AL_INIT, 0);
	board_lead_to(&b, PICCOLO_OP);
	expect(&b, AL_PREOP, AL_PREOP, 0);
	board_lead_to(&b, PICCOLO_OP);
	expect(&b, AL_INIT, AL_INIT, 0);
}

TEST(firmware, answers_a_state_request_within_two_milliseconds)
{
	struct board b;

	board_init(&b);
	board_start(&b);
	board_master_mailbox_sms(&b);
	board_run(&b, 5000);
	put_le16(b.memory + ESC_REG_AL_CONTROL, AL_PREOP);
	b.al_event |= 1;
	board_run(&b, 2000);
	CHECK_EQ(board_al_status(&b), AL_PREOP);
}

TEST(firmware, a_request_without_event_is_found_within_fifty_milliseconds)
{
	struct board b;

	board_init(&b);
	board_start(&b);
	board_master_mailbox_sms(&b);
	put_le16(b.memory + ESC_REG_AL_CONTROL, AL_PREOP);
	board_run(&b, 51000);
	CHECK_EQ(board_al_status(&b), AL_PREOP);
}

TEST(firmware, states_cannot_be_skipped)
{
	struct board b;

	board_init(&b);
	board_start(&b);
	expect(&b, AL_SAFEOP, ERROR_INIT, AL_CODE_INVALID_STATE_CHANGE);
	expect(&b, AL_INIT | AL_ERROR, AL_INIT, 0);
	expect(&b, AL_OP, ERROR_INIT, AL_CODE_INVALID_STATE_CHANGE);
	board_lead_to(&b, PICCOLO_PREOP);
	expect(&b, AL_OP, ERROR_PREOP, AL_CODE_INVALID_STATE_CHANGE);
}

TEST(firmware, unknown_states_and_boot_out_of_preop_are_refused_and_the_state_stays)
{
	static const uint16_t unknown[] = { 0, 5, 6, 7, 9, 15 };
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	expect(&b, AL_BOOT, ERROR_PREOP, AL_CODE_INVALID_STATE_CHANGE);
	for (size_t i = 0; i < sizeof(unknown) / sizeof(unknown[0]); i++) {
		expect(&b, (uint16_t)(unknown[i] | AL_ERROR), ERROR_PREOP, AL_CODE_UNKNOWN_STATE);
	}
}

TEST(firmware, boot_needs_mailboxes_and_is_left_to_init_only)
{
	struct board b;

	board_init(&b);
	board_start(&b);
	expect(&b, AL_BOOT, ERROR_INIT, AL_CODE_INVALID_MAILBOX_CONFIG_BOOT);
	board_master_mailbox_sms(&b);
	expect(&b, AL_BOOT | AL_ERROR, AL_BOOT, 0);
	expect(&b, AL_BOOT, AL_BOOT, 0);
	expect(&b, AL_PREOP, AL_BOOT | AL_ERROR, AL_CODE_INVALID_STATE_CHANGE);
	expect(&b, AL_SAFEOP | AL_ERROR, AL_BOOT | AL_ERROR, AL_CODE_INVALID_STATE_CHANGE);
	expect(&b, AL_OP | AL_ERROR, AL_BOOT | AL_ERROR, AL_CODE_INVALID_STATE_CHANGE);
	expect(&b, AL_INIT | AL_ERROR, AL_INIT, 0);
	expect(&b, AL_PREOP, AL_PREOP, 0);
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, no_request_counts_until_the_error_is_acknowledged)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	expect(&b, AL_OP, ERROR_PREOP, AL_CODE_INVALID_STATE_CHANGE);
	expect(&b, AL_SAFEOP, ERROR_PREOP, AL_CODE_INVALID_STATE_CHANGE);
	expect(&b, AL_PREOP | AL_ERROR, AL_PREOP, 0);
	expect(&b, AL_SAFEOP, AL_SAFEOP, 0);
}

TEST(firmware, an_acknowledge_may_carry_the_next_state)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	expect(&b, AL_OP, ERROR_PREOP, AL_CODE_INVALID_STATE_CHANGE);
	expect(&b, AL_SAFEOP | AL_ERROR, AL_SAFEOP, 0);
}

TEST(firmware, wrong_mailbox_sync_managers_keep_it_in_init)
{
	struct board b;

	board_init(&b);
	board_start(&b);
	expect(&b, AL_PREOP, ERROR_INIT, AL_CODE_INVALID_MAILBOX_CONFIG);
	board_master_mailbox_sms(&b);
	put_le16(b.memory + ESC_REG_SM + 8 + 2, 64);
	expect(&b, AL_PREOP | AL_ERROR, ERROR_INIT, AL_CODE_INVALID_MAILBOX_CONFIG);
	board_master_mailbox_sms(&b);
	b.memory[ESC_REG_SM + 6] = 0;
	expect(&b, AL_PREOP | AL_ERROR, ERROR_INIT, AL_CODE_INVALID_MAILBOX_CONFIG);
	board_master_mailbox_sms(&b);
	expect(&b, AL_PREOP | AL_ERROR, AL_PREOP, 0);
}

static void refuse_process_data(unsigned reg, uint16_t value, uint16_t code)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	put_le16(b.memory + ESC_REG_SM + reg, value);
	expect(&b, AL_SAFEOP, ERROR_PREOP, code);
	board_master_process_data(&b);
	expect(&b, AL_SAFEOP | AL_ERROR, AL_SAFEOP, 0);
}

TEST(firmware, wrong_process_data_sync_managers_keep_it_in_preop)
{
	refuse_process_data(16 + 0, 0x1108, AL_CODE_INVALID_OUTPUT_CONFIG);
	refuse_process_data(16 + 2, 8, AL_CODE_INVALID_OUTPUT_CONFIG);
	refuse_process_data(16 + 4, 0x20, AL_CODE_INVALID_OUTPUT_CONFIG);
	refuse_process_data(16 + 6, 0, AL_CODE_INVALID_OUTPUT_CONFIG);
	refuse_process_data(24 + 0, 0x1000, AL_CODE_INVALID_INPUT_CONFIG);
	refuse_process_data(24 + 2, 14, AL_CODE_INVALID_INPUT_CONFIG);
	refuse_process_data(24 + 4, 0x64, AL_CODE_INVALID_INPUT_CONFIG);
	refuse_process_data(24 + 6, 0, AL_CODE_INVALID_INPUT_CONFIG);
}

TEST(firmware, periodic_mode_needs_sync0_in_the_masters_hand)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	b.memory[ESC_REG_DC_ACTIVATION] = 0;
	expect(&b, AL_SAFEOP, ERROR_PREOP, AL_CODE_INVALID_DC_SYNC_CONFIG);
	b.memory[ESC_REG_DC_ACTIVATION] = 1; /* the unit runs, SYNC0 does not */
	expect(&b, AL_SAFEOP | AL_ERROR, ERROR_PREOP, AL_CODE_INVALID_DC_SYNC_CONFIG);
	board_master_give_sync(&b);
	expect(&b, AL_SAFEOP | AL_ERROR, ERROR_PREOP, AL_CODE_INVALID_DC_SYNC_CONFIG);
	board_master_sync0(&b, 0); /* a single shot is not periodic */
	expect(&b, AL_SAFEOP | AL_ERROR, ERROR_PREOP, AL_CODE_DC_INVALID_SYNC_CYCLE);
	board_master_sync0(&b, 99999);
	expect(&b, AL_SAFEOP | AL_ERROR, ERROR_PREOP, AL_CODE_DC_INVALID_SYNC_CYCLE);
	board_master_sync0(&b, 1000000001);
	expect(&b, AL_SAFEOP | AL_ERROR, ERROR_PREOP, AL_CODE_DC_INVALID_SYNC_CYCLE);
	board_master_sync0(&b, 100000);
	expect(&b, AL_SAFEOP | AL_ERROR, AL_SAFEOP, 0);
}

TEST(firmware, oneshot_mode_needs_the_sync_unit_for_itself)
{
	struct board b;

	board_lead_to_oneshot(&b, PICCOLO_PREOP);
	board_master_sync0(&b, 1000000);
	expect(&b, AL_SAFEOP, ERROR_PREOP, AL_CODE_INVALID_DC_SYNC_CONFIG);
	board_master_give_sync(&b);
	expect(&b, AL_SAFEOP | AL_ERROR, AL_SAFEOP, 0);
}

TEST(firmware, op_waits_for_outputs_and_the_first_sync0)
{
	struct board b;

	board_lead_to(&b, PICCOLO_SAFEOP);
	expect(&b, AL_OP, AL_SAFEOP, 0);
	board_sync0(&b, 1000000);
	board_run(&b, 3000);
	CHECK_EQ(board_al_status(&b), AL_SAFEOP);
	board_master_outputs(&b, 0, 0);
	board_run(&b, 3000);
	CHECK_EQ(board_al_status(&b), AL_OP);
}

TEST(firmware, op_without_sync0_ends_in_safeop_with_002d)
{
	struct board b;

	board_lead_to(&b, PICCOLO_SAFEOP);
	board_master_outputs(&b, 0, 0);
	expect(&b, AL_OP, AL_SAFEOP, 0);
	board_run(&b, 990000);
	CHECK_EQ(board_al_status(&b), AL_SAFEOP);
	board_run(&b, 20000);
	CHECK_EQ(board_al_status(&b), ERROR_SAFEOP);
	CHECK_EQ(board_al_code(&b), AL_CODE_NO_SYNC_ERROR);
}

TEST(firmware, op_without_outputs_ends_in_safeop_with_001b)
{
	struct board b;

	board_lead_to(&b, PICCOLO_SAFEOP);
	board_sync0(&b, 1000000);
	expect(&b, AL_OP, AL_SAFEOP, 0);
	board_run(&b, 1010000);
	CHECK_EQ(board_al_status(&b), ERROR_SAFEOP);
	CHECK_EQ(board_al_code(&b), AL_CODE_SM_WATCHDOG);
}

TEST(firmware, a_refused_request_ends_the_wait_for_op)
{
	struct board b;

	board_lead_to(&b, PICCOLO_SAFEOP);
	expect(&b, AL_OP, AL_SAFEOP, 0);
	expect(&b, AL_BOOT, ERROR_SAFEOP, AL_CODE_INVALID_STATE_CHANGE);
	board_sync0(&b, 1000000);
	board_master_outputs(&b, 0, 0);
	board_run(&b, 3000);
	CHECK_EQ(board_al_status(&b), ERROR_SAFEOP);
}

TEST(firmware, watchdog_in_op_falls_to_safeop_with_outputs_safe)
{
	struct board b;

	board_lead_to(&b, PICCOLO_OP);
	board_master_outputs(&b, 1, 0);
	board_run(&b, 11000);
	CHECK_EQ(b.led, 1);
	board_master_watchdog_expires(&b);
	board_run(&b, 11000);
	CHECK_EQ(board_al_status(&b), ERROR_SAFEOP);
	CHECK_EQ(board_al_code(&b), AL_CODE_SM_WATCHDOG);
	CHECK_EQ(b.led, 0);

	board_master_outputs(&b, 1, 0);
	board_run(&b, 11000);
	CHECK_EQ(b.led, 0); /* SAFEOP: outputs stay safe */
	expect(&b, AL_SAFEOP | AL_ERROR, AL_SAFEOP, 0);
	board_master_outputs(&b, 1, 0);
	expect(&b, AL_OP, AL_OP, 0);
}

TEST(firmware, watchdog_is_not_looked_at_when_sm2_does_not_trigger_it)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	b.memory[ESC_REG_SM + 16 + 4] = 0x24;
	expect(&b, AL_SAFEOP, AL_SAFEOP, 0);
	board_sync0(&b, 1000000);
	board_master_outputs(&b, 0, 0);
	expect(&b, AL_OP, AL_OP, 0);
	board_master_watchdog_expires(&b);
	board_run(&b, 11000);
	CHECK_EQ(board_al_status(&b), AL_OP);
}

TEST(firmware, sync0_that_stops_in_op_falls_to_safeop_with_002c)
{
	struct board b;

	board_lead_to(&b, PICCOLO_OP);
	board_master_outputs(&b, 1, 0);
	board_run(&b, 18000);
	CHECK_EQ(board_al_status(&b), AL_OP);
	CHECK_EQ(b.led, 1);
	board_run(&b, 20000);
	CHECK_EQ(board_al_status(&b), ERROR_SAFEOP);
	CHECK_EQ(board_al_code(&b), AL_CODE_FATAL_SYNC_ERROR);
	CHECK_EQ(b.led, 0);
}

TEST(firmware, a_sync_manager_switched_off_in_op_falls_to_preop)
{
	struct board b;

	board_lead_to(&b, PICCOLO_OP);
	b.memory[ESC_REG_SM + 24 + 6] = 0;
	b.al_event |= 0x0010;
	board_run(&b, 3000);
	CHECK_EQ(board_al_status(&b), ERROR_PREOP);
	CHECK_EQ(board_al_code(&b), AL_CODE_INVALID_INPUT_CONFIG);
	b.memory[ESC_REG_SM + 6] = 0;
	b.al_event |= 0x0010;
	board_run(&b, 3000);
	CHECK_EQ(board_al_status(&b), ERROR_INIT);
	CHECK_EQ(board_al_code(&b), AL_CODE_INVALID_MAILBOX_CONFIG);
}
