/* SPDX-License-Identifier: MIT */
/* Samples: periodic and one-shot, counter, time stamps, overruns, outputs. */
#include "base/bytes.h"
#include "board.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { SM3 = 0x1180, MS = 1000000 };

static uint16_t counter(const struct board *b)
{
	return get_le16(b->memory + SM3 + 2);
}

static uint64_t sample_time(const struct board *b)
{
	return get_le64(b->memory + SM3 + 4);
}

static uint8_t status(const struct board *b)
{
	return b->memory[SM3 + 12];
}

TEST(firmware, each_sync0_puts_one_sample_into_sm3_at_once)
{
	struct board b;

	board_lead_to(&b, PICCOLO_SAFEOP);
	CHECK_EQ(counter(&b), 0);
	for (unsigned i = 1; i <= 5; i++) {
		unsigned before = b.input_writes;

		b.adc = (uint16_t)(1000 + i);
		board_sync0(&b, UINT64_C(0x123456789abcd000) + (uint64_t)i * MS);
		CHECK_EQ(b.input_writes, before + 1);
		CHECK_EQ(get_le16(b.memory + SM3), 1000 + i);
		CHECK_EQ(counter(&b), i);
		CHECK_EQ(sample_time(&b), UINT64_C(0x123456789abcd000) + (uint64_t)i * MS);
		CHECK_EQ(status(&b), 0);
	}
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, sync0_below_safeop_makes_no_sample)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	board_sync0(&b, MS);
	CHECK_EQ(b.input_writes, 0);
	CHECK_EQ(b.fw.inputs.counter, 0);
}

TEST(firmware, counter_wraps_at_65535)
{
	struct board b;

	board_lead_to(&b, PICCOLO_SAFEOP);
	for (uint64_t i = 1; i <= 65537; i++) {
		board_sync0(&b, i * MS);
		CHECK_EQ(counter(&b), i & 0xffff);
	}
	CHECK_EQ(counter(&b), 1);
	CHECK_EQ(status(&b), 0);
}

TEST(firmware, counter_starts_at_zero_after_preop)
{
	struct board b;

	board_lead_to(&b, PICCOLO_OP);
	board_sync0(&b, 2 * MS);
	CHECK_EQ(counter(&b), 2);
	CHECK_EQ(board_master_request(&b, AL_SAFEOP), AL_SAFEOP);
	board_sync0(&b, 3 * MS);
	CHECK_EQ(counter(&b), 3);
	CHECK_EQ(board_master_request(&b, AL_PREOP), AL_PREOP);
	CHECK_EQ(board_master_request(&b, AL_SAFEOP), AL_SAFEOP);
	CHECK_EQ(counter(&b), 0);
}

TEST(firmware, a_lost_edge_is_marked_in_the_next_sample_only)
{
	struct board b;

	board_lead_to(&b, PICCOLO_SAFEOP);
	board_sync0(&b, 1 * MS);
	board_sync0(&b, 3 * MS);
	CHECK_EQ(status(&b), PICCOLO_STATUS_OVERRUN);
	CHECK_EQ(counter(&b), 2);
	board_sync0(&b, 4 * MS);
	CHECK_EQ(status(&b), 0);
	b.adc_overrun = 1;
	board_sync0(&b, 5 * MS);
	CHECK_EQ(status(&b), PICCOLO_STATUS_OVERRUN);
	board_sync0(&b, 6 * MS);
	CHECK_EQ(status(&b), 0);
	CHECK_EQ(b.fw.sync0.overruns, 2);
}

TEST(firmware, a_conversion_before_safeop_is_no_overrun)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	b.adc_overrun = 1;
	CHECK_EQ(board_master_request(&b, AL_SAFEOP), AL_SAFEOP);
	board_sync0(&b, 700 * (uint64_t)MS);
	CHECK_EQ(status(&b), 0);
}

TEST(firmware, an_edge_while_interrupts_are_off_is_served_right_after)
{
	struct board b;

	board_lead_to(&b, PICCOLO_SAFEOP);
	b.is_masked = 1;
	board_sync0(&b, 1 * MS);
	CHECK_EQ(counter(&b), 0);
	b.fw.hal.interrupts_on(&b);
	CHECK_EQ(counter(&b), 1);
	CHECK_EQ(sample_time(&b), 1 * MS);
}

TEST(firmware, outputs_are_taken_every_refresh_and_only_in_op)
{
	struct board b;

	board_lead_to(&b, PICCOLO_SAFEOP);
	board_master_outputs(&b, 0xff, 0);
	board_run(&b, 30000);
	CHECK_EQ(b.led, 0);
	board_sync0(&b, MS);
	board_master_outputs(&b, 0xff, 0);
	CHECK_EQ(board_master_request(&b, AL_OP), AL_OP);
	board_run(&b, 12000);
	CHECK_EQ(b.led, 1);
	board_master_outputs(&b, 0xfe, 0);
	board_run(&b, 12000);
	CHECK_EQ(b.led, 0);
	CHECK_EQ(board_breaches(&b), 0);
}

/* --- one-shot --- */

static void fire(struct board *b, uint64_t at_ns)
{
	board_set_dc_time(b, at_ns + 12000);
	board_sync0(b, at_ns);
}

static void command(struct board *b, uint64_t now_ns, uint64_t at_ns)
{
	board_set_dc_time(b, now_ns);
	board_master_outputs(b, 0, at_ns);
	board_run(b, 21000);
}

TEST(firmware, a_future_oneshot_time_is_armed_and_fires_once)
{
	const uint64_t now = UINT64_C(845000000000000000);
	struct board b;

	board_lead_to_oneshot(&b, PICCOLO_OP);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
	command(&b, now, now + 5 * MS);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT | PICCOLO_STATUS_ARMED);
	CHECK_EQ(get_le64(b.memory + ESC_REG_DC_START_TIME), now + 5 * MS);
	CHECK_EQ(get_le32(b.memory + ESC_REG_DC_SYNC0_CYCLE), 0);
	CHECK_EQ(b.memory[ESC_REG_DC_ACTIVATION], 3);

	b.adc = 777;
	fire(&b, now + 5 * MS);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
	CHECK_EQ(get_le16(b.memory + SM3), 777);
	CHECK_EQ(counter(&b), 1);
	CHECK_EQ(sample_time(&b), now + 5 * MS);

	/* the same value does not arm again, a changed one does */
	command(&b, now, now + 5 * MS);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
	command(&b, now + 6 * MS, now + 9 * MS);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT | PICCOLO_STATUS_ARMED);
	fire(&b, now + 9 * MS);
	CHECK_EQ(counter(&b), 2);
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, a_past_or_too_near_oneshot_time_is_not_armed)
{
	const uint64_t now = UINT64_C(845000000000000000);
	struct board b;

	board_lead_to_oneshot(&b, PICCOLO_OP);
	command(&b, now, now - 1);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
	command(&b, now, now);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
	command(&b, now, now + PICCOLO_ONESHOT_LEAD_NS - 1);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
	CHECK_EQ(b.activation_writes, 0);
	command(&b, now, 1);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
	command(&b, now, now + PICCOLO_ONESHOT_LEAD_NS);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT | PICCOLO_STATUS_ARMED);
}

TEST(firmware, zero_and_a_past_time_withdraw_an_armed_shot)
{
	const uint64_t now = UINT64_C(845000000000000000);
	struct board b;

	board_lead_to_oneshot(&b, PICCOLO_OP);
	command(&b, now, now + 50 * MS);
	CHECK_EQ(b.memory[ESC_REG_DC_ACTIVATION], 3);
	command(&b, now, 0);
	CHECK_EQ(b.memory[ESC_REG_DC_ACTIVATION], 0);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
	command(&b, now, now + 50 * MS);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT | PICCOLO_STATUS_ARMED);
	command(&b, now, now - 50 * MS);
	CHECK_EQ(b.memory[ESC_REG_DC_ACTIVATION], 0);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
}

TEST(firmware, an_edge_of_a_withdrawn_shot_is_nobodys_sample)
{
	const uint64_t now = UINT64_C(845000000000000000);
	struct board b;

	board_lead_to_oneshot(&b, PICCOLO_OP);
	board_sync0(&b, now);
	CHECK_EQ(counter(&b), 0);
	command(&b, now, now + 50 * MS);
	board_sync0(&b, now + 1 * MS); /* the clock still shows now */
	CHECK_EQ(counter(&b), 0);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT | PICCOLO_STATUS_ARMED);
	fire(&b, now + 50 * MS);
	CHECK_EQ(counter(&b), 1);
	CHECK_EQ(status(&b), PICCOLO_STATUS_ONESHOT);
}

TEST(firmware, leaving_op_disarms)
{
	const uint64_t now = UINT64_C(845000000000000000);
	struct board b;

	board_lead_to_oneshot(&b, PICCOLO_OP);
	command(&b, now, now + 50 * MS);
	CHECK_EQ(board_master_request(&b, AL_SAFEOP), AL_SAFEOP);
	CHECK_EQ(b.memory[ESC_REG_DC_ACTIVATION], 0);
	CHECK_EQ(b.fw.sync0.armed, 0);
}

TEST(firmware, oneshot_time_means_nothing_in_periodic_mode)
{
	const uint64_t now = UINT64_C(845000000000000000);
	struct board b;

	board_lead_to(&b, PICCOLO_OP);
	board_set_dc_time(&b, now);
	board_master_outputs(&b, 0, now + 5 * MS);
	board_run(&b, 12000);
	CHECK_EQ(b.fw.sync0.armed, 0);
	CHECK_EQ(b.memory[ESC_REG_DC_ACTIVATION], 3);
	CHECK_EQ(get_le32(b.memory + ESC_REG_DC_SYNC0_CYCLE), 1 * MS);
}
