/* SPDX-License-Identifier: MIT */
/* The mailbox: counters, repetition, full mailboxes, what is not CoE. */
#include "base/bytes.h"
#include "board.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

static const uint8_t write_refresh_20[10] = { 0x00, 0x20, 0x2b, 0x00, 0x80, 2, 20, 0 };
static const uint8_t write_refresh_30[10] = { 0x00, 0x20, 0x2b, 0x00, 0x80, 2, 30, 0 };
static const uint8_t read_refresh[10] = { 0x00, 0x20, 0x40, 0x00, 0x80, 2 };

enum { COE = 3, REPEAT = 0x02, SM1_ACTIVATE = ESC_REG_SM + 8 + 6, SM1_PDI = ESC_REG_SM + 8 + 7 };

TEST(firmware, a_repeated_mailbox_counter_is_not_executed_twice_and_is_answered_again)
{
	struct board b;
	uint8_t first[128], again[128];

	board_lead_to(&b, PICCOLO_PREOP);
	board_mailbox_put(&b, COE, 1, write_refresh_20, 10);
	CHECK_EQ(board_mailbox_take(&b, first), 0);
	CHECK_EQ(b.fw.refresh_ms, 20);

	/* the same counter with other content shows that nothing is executed */
	board_mailbox_put(&b, COE, 1, write_refresh_30, 10);
	CHECK_EQ(board_mailbox_take(&b, again), 0);
	CHECK_EQ(b.fw.refresh_ms, 20);
	CHECK_MEM(first, again, 16);

	board_mailbox_put(&b, COE, 2, write_refresh_30, 10);
	CHECK_EQ(board_mailbox_take(&b, again), 0);
	CHECK_EQ(b.fw.refresh_ms, 30);
	CHECK_EQ(again[5] >> 4, first[5] / 16 % 7 + 1);
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, a_repetition_while_its_answer_still_lies_there_adds_none)
{
	struct board b;
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	board_mailbox_put(&b, COE, 1, read_refresh, 10);
	board_run(&b, 5000);
	CHECK(b.is_sm1_full);
	board_mailbox_put(&b, COE, 1, read_refresh, 10);
	board_run(&b, 5000);
	CHECK(!b.is_sm0_full);
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	CHECK_EQ(board_mailbox_take(&b, answer), -1);
}

TEST(firmware, counter_zero_is_never_a_repetition)
{
	struct board b;
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	board_mailbox_put(&b, COE, 0, write_refresh_20, 10);
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	board_mailbox_put(&b, COE, 0, write_refresh_30, 10);
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	CHECK_EQ(b.fw.refresh_ms, 30);
}

TEST(firmware, a_new_run_may_begin_with_the_old_counter)
{
	struct board b;
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	board_mailbox_put(&b, COE, 1, write_refresh_20, 10);
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	CHECK_EQ(board_master_request(&b, AL_INIT), AL_INIT);
	CHECK_EQ(board_master_request(&b, AL_PREOP), AL_PREOP);
	CHECK_EQ(b.fw.refresh_ms, PICCOLO_REFRESH_DEFAULT_MS);
	board_mailbox_put(&b, COE, 1, write_refresh_30, 10);
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	CHECK_EQ(b.fw.refresh_ms, 30);
}

TEST(firmware, an_answer_waits_until_the_master_has_taken_the_one_before)
{
	struct board b;
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	board_mailbox_put(&b, COE, 1, write_refresh_20, 10);
	board_run(&b, 5000);
	board_mailbox_put(&b, COE, 2, read_refresh, 10);
	board_run(&b, 20000);
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	CHECK_EQ(answer[6 + 2], 0x60);
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	CHECK_EQ(answer[6 + 6], 20);
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, a_toggled_repeat_request_brings_the_last_answer_back)
{
	struct board b;
	uint8_t first[128], again[128];

	board_lead_to(&b, PICCOLO_PREOP);
	board_mailbox_put(&b, COE, 1, read_refresh, 10);
	CHECK_EQ(board_mailbox_take(&b, first), 0);
	b.memory[SM1_ACTIVATE] ^= REPEAT;
	b.al_event |= 0x0010;
	CHECK_EQ(board_mailbox_take(&b, again), 0);
	CHECK_MEM(first, again, 16);
	CHECK_EQ(b.memory[SM1_PDI] & REPEAT, REPEAT);
	b.memory[SM1_ACTIVATE] ^= REPEAT;
	b.al_event |= 0x0010;
	CHECK_EQ(board_mailbox_take(&b, again), 0);
	CHECK_EQ(b.memory[SM1_PDI] & REPEAT, 0);
	CHECK_EQ(board_mailbox_take(&b, again), -1);
}

TEST(firmware, a_repeat_request_before_any_answer_is_just_acknowledged)
{
	struct board b;
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	b.memory[SM1_ACTIVATE] ^= REPEAT;
	b.al_event |= 0x0010;
	CHECK_EQ(board_mailbox_take(&b, answer), -1);
	CHECK_EQ(b.memory[SM1_PDI] & REPEAT, REPEAT);
}

static void expect_error(uint8_t type, const uint8_t *data, size_t len, uint16_t detail)
{
	struct board b;
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	board_mailbox_put(&b, type, 1, data, len);
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	CHECK_EQ(get_le16(answer), 4);
	CHECK_EQ(answer[5] & 0x0f, 0);
	CHECK_EQ(get_le16(answer + 6), 1);
	CHECK_EQ(get_le16(answer + 8), detail);
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, what_is_not_an_sdo_gets_a_mailbox_error)
{
	uint8_t data[128] = { 0 };

	expect_error(2, data, 20, 2); /* EoE */
	expect_error(5, data, 20, 2); /* SoE */
	expect_error(0, data, 4, 2);
	data[1] = 0x80;
	expect_error(COE, data, 10, 4); /* SDO information */
	data[1] = 0x20;
	expect_error(COE, data, 1, 6);
	expect_error(COE, data, 9, 6);
	expect_error(COE, data, 0, 6);
	expect_error(COE, data, 123, 8);
	expect_error(COE, data, 0xffff, 8);
}

TEST(firmware, the_longest_request_is_read_to_its_end)
{
	struct board b;
	uint8_t data[122] = { 0x00, 0x20, 0x21, 0x00, 0x80, 2, 2, 0, 0, 0, 25, 0 };
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	board_mailbox_put(&b, COE, 1, data, sizeof(data));
	CHECK_EQ(board_mailbox_take(&b, answer), 0);
	CHECK_EQ(answer[6 + 2], 0x60);
	CHECK_EQ(b.fw.refresh_ms, 25);
	CHECK(!b.is_sm0_full);
}

TEST(firmware, the_mailbox_is_dead_in_init)
{
	struct board b;
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	CHECK_EQ(board_master_request(&b, AL_INIT), AL_INIT);
	board_mailbox_put(&b, COE, 1, read_refresh, 10);
	CHECK_EQ(board_mailbox_take(&b, answer), -1);
}

TEST(firmware, sync0_is_served_while_the_mailbox_is_busy)
{
	struct board b;
	uint8_t answer[128];
	uint64_t edge = 1000000;

	board_lead_to(&b, PICCOLO_OP);
	for (uint8_t i = 0; i < 50; i++) {
		uint16_t before = b.fw.inputs.counter;

		board_mailbox_put(&b, COE, (uint8_t)(i % 7 + 1), read_refresh, 10);
		while (!b.is_sm1_full) {
			(void)piccolo_step(&b.fw);
			b.us += 20;
			edge += 1000000;
			board_sync0(&b, edge);
			before++;
			CHECK_EQ(b.fw.inputs.counter, before);
		}
		CHECK_EQ(board_mailbox_take(&b, answer), 0);
		board_master_outputs(&b, 0, 0);
	}
	CHECK_EQ(board_al_status(&b), AL_OP);
	CHECK_EQ(board_breaches(&b), 0);
}
