/* SPDX-License-Identifier: MIT */
/* Buffers between the master and the application. */
#include "base/bytes.h"
#include "bench.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum {
	START = 0x1100,
	LEN = 4,
	OUTPUTS = 0x24, /* buffered, master writes, event to the PDI */
	INPUTS = 0x20,
	MAILBOX_OUT = 0x26,
	MAILBOX_IN = 0x22,
	STATUS = ESC_REG_SM + 5,
	ACTIVATE = ESC_REG_SM + 6,
	PDI_CONTROL = ESC_REG_SM + 7,
	FULL = 0x08,
	EVENT_SM0 = 0x0100,
};

static uint16_t master_writes(struct bench *b, uint16_t at, const char *text, uint16_t len)
{
	uint8_t data[64];

	memcpy(data, text, len);
	return bench_send(b, ECAT_CMD_FPWR, BENCH_STATION, at, data, len);
}

static uint16_t master_reads(struct bench *b, uint16_t at, char *ret_text, uint16_t len)
{
	return bench_send(b, ECAT_CMD_FPRD, BENCH_STATION, at, ret_text, len);
}

static uint32_t al_event(struct bench *b)
{
	uint8_t event[4];

	bench_pdi_read(b, 0, ESC_REG_AL_EVENT_REQUEST, event, 4);
	return get_le32(event);
}

TEST(sync_manager, the_reader_always_gets_the_newest_whole_buffer)
{
	struct bench *b = bench_create_one();
	char got[5] = "";

	bench_sm(b, BENCH_STATION, 0, START, LEN, OUTPUTS);
	CHECK_EQ(master_writes(b, START, "aaaa", 4), 1);
	CHECK_EQ(master_writes(b, START, "bbbb", 4), 1);
	CHECK_EQ(master_writes(b, START, "cccc", 4), 1);
	bench_pdi_read(b, 0, START, got, 4);
	CHECK_STR(got, "cccc");
	bench_pdi_read(b, 0, START, got, 4);
	CHECK_STR(got, "cccc");
	bench_destroy(b);
}

TEST(sync_manager, a_buffer_that_is_being_read_does_not_change)
{
	struct bench *b = bench_create_one();
	char got[5] = "";

	bench_sm(b, BENCH_STATION, 0, START, LEN, OUTPUTS);
	CHECK_EQ(master_writes(b, START, "aaaa", 4), 1);
	bench_pdi_read(b, 0, START, got, 2);
	CHECK_EQ(master_writes(b, START, "bbbb", 4), 1);
	CHECK_EQ(master_writes(b, START, "cccc", 4), 1);
	bench_pdi_read(b, 0, START + 2, got + 2, 2);
	CHECK_STR(got, "aaaa");
	bench_pdi_read(b, 0, START, got, 4);
	CHECK_STR(got, "cccc");
	bench_destroy(b);
}

TEST(sync_manager, a_buffer_half_written_is_not_seen)
{
	struct bench *b = bench_create_one();
	char got[5] = "";

	bench_sm(b, BENCH_STATION, 0, START, LEN, INPUTS);
	bench_pdi_write(b, 0, START, "aaaa", 4);
	bench_pdi_write(b, 0, START, "bb", 2);
	CHECK_EQ(master_reads(b, START, got, 4), 1);
	CHECK_STR(got, "aaaa");
	bench_pdi_write(b, 0, START + 2, "bb", 2);
	CHECK_EQ(master_reads(b, START, got, 4), 1);
	CHECK_STR(got, "bbbb");
	bench_destroy(b);
}

TEST(sync_manager, access_that_does_not_open_the_buffer_is_refused)
{
	struct bench *b = bench_create_one();
	char got[5] = "....";

	bench_sm(b, BENCH_STATION, 0, START, LEN, OUTPUTS);
	CHECK_EQ(master_writes(b, START + 1, "xyz", 3), 0);
	CHECK_EQ(master_writes(b, START, "ab", 2), 1);
	CHECK_EQ(master_writes(b, START + 2, "cd", 2), 1);
	CHECK_EQ(master_writes(b, START + 2, "ef", 2), 0);
	bench_pdi_read(b, 0, START, got, 4);
	CHECK_STR(got, "abcd");
	bench_destroy(b);
}

TEST(sync_manager, neither_side_gets_in_from_the_wrong_end)
{
	struct bench *b = bench_create_one();
	char got[5] = "";

	bench_sm(b, BENCH_STATION, 0, START, LEN, OUTPUTS);
	bench_sm(b, BENCH_STATION, 1, START + 64, LEN, INPUTS);
	CHECK_EQ(master_reads(b, START, got, 4), 0);
	CHECK_EQ(master_writes(b, START + 64, "aaaa", 4), 0);
	CHECK_EQ(master_writes(b, START, "good", 4), 1);
	bench_pdi_write(b, 0, START, "evil", 4);
	bench_pdi_read(b, 0, START, got, 4);
	CHECK_STR(got, "good");
	bench_destroy(b);
}

TEST(sync_manager, the_event_comes_with_the_last_byte_and_goes_when_the_buffer_is_read)
{
	struct bench *b = bench_create_one();
	char got[5] = "";

	bench_sm(b, BENCH_STATION, 0, START, LEN, OUTPUTS);
	CHECK_EQ(master_writes(b, START, "ab", 2), 1);
	CHECK_EQ(al_event(b) & EVENT_SM0, 0);
	CHECK_EQ(master_writes(b, START + 2, "cd", 2), 1);
	CHECK_EQ(al_event(b) & EVENT_SM0, EVENT_SM0);
	bench_pdi_read(b, 0, START, got, 4);
	CHECK_EQ(al_event(b) & EVENT_SM0, 0);
	bench_destroy(b);
}

TEST(sync_manager, a_full_mailbox_refuses_a_second_letter)
{
	struct bench *b = bench_create_one();
	char got[5] = "";

	bench_sm(b, BENCH_STATION, 0, START, LEN, MAILBOX_OUT);
	CHECK_EQ(bench_read8(b, BENCH_STATION, STATUS) & FULL, 0);
	CHECK_EQ(master_writes(b, START, "one.", 4), 1);
	CHECK_EQ(bench_read8(b, BENCH_STATION, STATUS) & FULL, FULL);
	CHECK_EQ(master_writes(b, START, "two.", 4), 0);
	bench_pdi_read(b, 0, START, got, 4);
	CHECK_STR(got, "one.");
	CHECK_EQ(bench_read8(b, BENCH_STATION, STATUS) & FULL, 0);
	CHECK_EQ(master_writes(b, START, "two.", 4), 1);
	bench_destroy(b);
}

TEST(sync_manager, an_empty_mailbox_gives_no_wkc)
{
	struct bench *b = bench_create_one();
	char got[5] = "";

	bench_sm(b, BENCH_STATION, 0, START, LEN, MAILBOX_IN);
	CHECK_EQ(master_reads(b, START, got, 4), 0);
	bench_pdi_write(b, 0, START, "mail", 4);
	CHECK_EQ(master_reads(b, START, got, 4), 1);
	CHECK_STR(got, "mail");
	CHECK_EQ(master_reads(b, START, got, 4), 0);
	bench_destroy(b);
}

TEST(sync_manager, a_letter_half_read_stays)
{
	struct bench *b = bench_create_one();
	char got[5] = "";

	bench_sm(b, BENCH_STATION, 0, START, LEN, MAILBOX_IN);
	bench_pdi_write(b, 0, START, "mail", 4);
	CHECK_EQ(master_reads(b, START, got, 2), 1);
	CHECK_EQ(bench_read8(b, BENCH_STATION, STATUS) & FULL, FULL);
	CHECK_EQ(master_reads(b, START, got, 4), 1);
	CHECK_STR(got, "mail");
	CHECK_EQ(bench_read8(b, BENCH_STATION, STATUS) & FULL, 0);
	bench_destroy(b);
}

TEST(sync_manager, an_active_one_keeps_its_area)
{
	struct bench *b = bench_create_one();
	uint8_t zeros[ESC_SM_BYTES] = { 0 };

	bench_sm(b, BENCH_STATION, 0, START, LEN, OUTPUTS);
	bench_write16(b, BENCH_STATION, ESC_REG_SM, 0x1800);
	CHECK_EQ(bench_read16(b, BENCH_STATION, ESC_REG_SM), START);
	/* Switched off, it can be changed. */
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, BENCH_STATION, ESC_REG_SM, zeros, sizeof(zeros)), 1);
	CHECK_EQ(bench_read8(b, BENCH_STATION, ACTIVATE), 0);
	bench_write16(b, BENCH_STATION, ESC_REG_SM, 0x1800);
	CHECK_EQ(bench_read16(b, BENCH_STATION, ESC_REG_SM), 0x1800);
	bench_destroy(b);
}

TEST(sync_manager, the_pdi_can_switch_one_off)
{
	struct bench *b = bench_create_one();
	uint8_t off[1] = { 1 };
	uint8_t on[1] = { 0 };

	bench_sm(b, BENCH_STATION, 0, START, LEN, MAILBOX_OUT);
	CHECK_EQ(master_writes(b, START, "full", 4), 1);
	bench_pdi_write(b, 0, PDI_CONTROL, off, 1);
	CHECK_EQ(bench_read8(b, BENCH_STATION, PDI_CONTROL) & 1, 1);
	bench_pdi_write(b, 0, PDI_CONTROL, on, 1);
	/* It comes back empty. */
	CHECK_EQ(bench_read8(b, BENCH_STATION, STATUS) & FULL, 0);
	CHECK_EQ(master_writes(b, START, "next", 4), 1);
	bench_destroy(b);
}

TEST(sync_manager, a_change_of_activation_is_an_event_until_the_pdi_reads_it)
{
	struct bench *b = bench_create_one();
	uint8_t activate[1];

	bench_sm(b, BENCH_STATION, 0, START, LEN, OUTPUTS);
	CHECK_EQ(al_event(b) & ESC_AL_EVENT_SM_ACTIVATION, ESC_AL_EVENT_SM_ACTIVATION);
	bench_pdi_read(b, 0, ACTIVATE, activate, 1);
	CHECK_EQ(activate[0], 1);
	CHECK_EQ(al_event(b) & ESC_AL_EVENT_SM_ACTIVATION, 0);
	bench_destroy(b);
}

TEST(sync_manager, a_buffered_one_without_length_is_off)
{
	struct bench *b = bench_create_one();

	bench_sm(b, BENCH_STATION, 0, START, 0, OUTPUTS);
	CHECK_EQ(master_writes(b, START, "ram.", 4), 1); /* plain memory */
	CHECK_EQ(al_event(b) & EVENT_SM0, 0);
	bench_destroy(b);
}

TEST(sync_manager, three_buffers_that_do_not_fit_are_survived)
{
	struct bench *b = bench_create_one();
	char got[5] = "";

	bench_sm(b, BENCH_STATION, 0, 0x2ffc, 4, OUTPUTS);
	CHECK_EQ(master_writes(b, 0x2ffc, "last", 4), 1);
	bench_pdi_read(b, 0, 0x2ffc, got, 4);
	CHECK_STR(got, "last");
	bench_sm(b, BENCH_STATION, 1, 0xfff0, 64, OUTPUTS);
	CHECK_EQ(master_writes(b, 0xfff0, "beyond the end..", 16), 0);
	bench_destroy(b);
}
