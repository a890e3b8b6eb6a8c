/* SPDX-License-Identifier: MIT */
/* Mailbox and SDO server of a slave that is only an SII. */
#include "base/bytes.h"
#include "harness/test.h"
#include "terminal.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum {
	STATION = BENCH_STATION,
	BOX = 128,
	SMALL_BOX = 24,
	UPLOAD = 0x40,
	UPLOAD_ALL = 0x50,
	DOWNLOAD_1 = 0x2f,
	DOWNLOAD_2 = 0x2b,
	DOWNLOAD_4 = 0x23,
	ABORT = 0x80,
	DONE = 0x60,
};

static struct bench *in_preop(uint16_t mailbox_bytes)
{
	struct bench *b = terminal_create(mailbox_bytes);

	terminal_to_preop(b, mailbox_bytes);
	return b;
}

static uint32_t upload(struct bench *b, uint16_t index, uint8_t subindex)
{
	uint8_t a[BOX];

	CHECK_EQ(terminal_sdo(b, UPLOAD, index, subindex, 0, a), 10);
	CHECK_EQ(get_le16(a) >> 12, 3);
	CHECK_EQ(a[2] & 0xe3, 0x43);
	CHECK_EQ(get_le16(a + 3), index);
	CHECK_EQ(a[5], subindex);
	return get_le32(a + 6);
}

static uint32_t abort_of(struct bench *b, uint8_t command, uint16_t index, uint8_t subindex,
			 uint32_t value)
{
	uint8_t a[BOX];

	CHECK_EQ(terminal_sdo(b, command, index, subindex, value, a), 10);
	/* Captures: an abort is an SDO request, its command byte exactly 0x80. */
	CHECK_EQ(get_le16(a) >> 12, 2);
	CHECK_EQ(a[2], ABORT);
	CHECK_EQ(get_le16(a + 3), index);
	return get_le32(a + 6);
}

static void download(struct bench *b, uint8_t command, uint16_t index, uint8_t subindex,
		     uint32_t value)
{
	uint8_t a[BOX];

	CHECK_EQ(terminal_sdo(b, command, index, subindex, value, a), 10);
	CHECK_EQ(get_le16(a) >> 12, 3);
	CHECK_EQ(a[2], DONE);
}

TEST(sim_coe, identity_comes_from_the_sii)
{
	struct bench *b = in_preop(BOX);

	CHECK_EQ(upload(b, 0x1000, 0), 5001);
	CHECK_EQ(upload(b, 0x1018, 0), 4);
	CHECK_EQ(upload(b, 0x1018, 1), 0x00c0ffee);
	CHECK_EQ(upload(b, 0x1018, 2), 0x12345678);
	CHECK_EQ(upload(b, 0x1018, 3), 0x00010002);
	CHECK_EQ(upload(b, 0x1018, 4), 4711);
	bench_destroy(b);
}

TEST(sim_coe, assignment_and_mapping_come_from_the_siis_pdos)
{
	struct bench *b = in_preop(BOX);

	CHECK_EQ(upload(b, 0x1c00, 0), 4);
	for (uint8_t sm = 1; sm <= 4; sm++) {
		CHECK_EQ(upload(b, 0x1c00, sm), sm);
	}
	CHECK_EQ(upload(b, 0x1c12, 0), 2);
	CHECK_EQ(upload(b, 0x1c12, 1), 0x1600);
	CHECK_EQ(upload(b, 0x1c12, 2), 0x1601);
	CHECK_EQ(upload(b, 0x1c13, 0), 1);
	CHECK_EQ(upload(b, 0x1c13, 1), 0x1a00);
	CHECK_EQ(upload(b, 0x1a00, 0), 2);
	CHECK_EQ(upload(b, 0x1a00, 2), 0x60000210);
	CHECK_EQ(upload(b, 0x1601, 1), 0x70100101);
	CHECK_EQ(upload(b, 0x1601, 2), 0x00000007);
	CHECK_EQ(upload(b, 0x6000, 0), 2);
	CHECK_EQ(upload(b, 0x6000, 2), 0);
	bench_destroy(b);
}

TEST(sim_coe, what_is_not_there_is_aborted_with_its_reason)
{
	struct bench *b = in_preop(BOX);

	CHECK_EQ(abort_of(b, UPLOAD, 0x2000, 0, 0), 0x06020000);
	CHECK_EQ(abort_of(b, UPLOAD, 0x1018, 5, 0), 0x06090011);
	CHECK_EQ(abort_of(b, UPLOAD, 0x1c10, 0, 0), 0x06020000);
	CHECK_EQ(abort_of(b, UPLOAD, 0x0000, 0, 0), 0x06020000);
	CHECK_EQ(abort_of(b, DOWNLOAD_4, 0x1018, 1, 7), 0x06010002);
	CHECK_EQ(abort_of(b, DOWNLOAD_4, 0x1a00, 1, 7), 0x06010002);
	CHECK_EQ(abort_of(b, DOWNLOAD_4, 0x7000, 1, 7), 0x06070010);
	CHECK_EQ(abort_of(b, 0xe0, 0x1000, 0, 0), 0x05040001);
	CHECK_EQ(abort_of(b, 0x60, 0, 0, 0), 0x05040001); /* a segment of nothing */
	bench_destroy(b);
}

TEST(sim_coe, an_entry_keeps_what_was_written_until_init)
{
	struct bench *b = in_preop(BOX);

	download(b, DOWNLOAD_2, 0x7000, 1, 0xbeef);
	CHECK_EQ(upload(b, 0x7000, 1), 0xbeef);
	CHECK_EQ(terminal_request(b, AL_INIT), AL_INIT);
	CHECK_EQ(terminal_request(b, AL_PREOP), AL_PREOP);
	CHECK_EQ(upload(b, 0x7000, 1), 0);
	bench_destroy(b);
}

TEST(sim_coe, assignment_can_be_changed_in_preop_by_the_rules)
{
	struct bench *b = in_preop(BOX);

	CHECK_EQ(abort_of(b, DOWNLOAD_2, 0x1c13, 1, 0x1a01), 0x06010003);
	download(b, DOWNLOAD_1, 0x1c13, 0, 0);
	CHECK_EQ(abort_of(b, DOWNLOAD_2, 0x1c13, 1, 0x1600), 0x06040041);
	CHECK_EQ(abort_of(b, DOWNLOAD_2, 0x1c13, 1, 0x1a77), 0x06040041);
	download(b, DOWNLOAD_2, 0x1c13, 1, 0x1a01);
	CHECK_EQ(abort_of(b, DOWNLOAD_1, 0x1c13, 0, 2), 0x06040042);
	download(b, DOWNLOAD_1, 0x1c13, 0, 1);
	CHECK_EQ(upload(b, 0x1c13, 1), 0x1a01);
	/* Now one input byte is right, four are not. */
	bench_sm(b, STATION, 2, TERMINAL_OUTPUTS, TERMINAL_OUTPUT_BYTES, 0x64);
	bench_sm(b, STATION, 3, TERMINAL_INPUTS, TERMINAL_INPUT_BYTES, 0x20);
	CHECK_EQ(terminal_request(b, AL_SAFEOP), AL_PREOP | AL_ERROR);
	CHECK_EQ(terminal_code(b), AL_CODE_INVALID_INPUT_CONFIG);
	bench_write8(b, STATION, ESC_REG_SM + 3 * ESC_SM_BYTES + 6, 0);
	bench_sm(b, STATION, 3, TERMINAL_INPUTS, 1, 0x20);
	CHECK_EQ(terminal_request(b, AL_SAFEOP | AL_ERROR), AL_SAFEOP);
	CHECK_EQ(abort_of(b, DOWNLOAD_1, 0x1c13, 0, 0), 0x08000022);
	bench_destroy(b);
}

TEST(sim_coe, a_long_value_comes_in_segments_where_the_box_is_small)
{
	struct bench *b = in_preop(SMALL_BOX);
	uint8_t a[BOX];

	/* "Made-up terminal" has 16 bytes; 8 fit behind the SDO header. */
	CHECK_EQ(terminal_sdo(b, UPLOAD, 0x1008, 0, 0, a), SMALL_BOX - 6);
	CHECK_EQ(a[2], 0x41);
	CHECK_EQ(get_le32(a + 6), 16);
	CHECK_MEM(a + 10, "Made-up ", 8);
	CHECK_EQ(terminal_sdo(b, 0x60, 0, 0, 0, a), 3 + 8);
	CHECK_EQ(a[2], 0x01);
	CHECK_MEM(a + 3, "terminal", 8);
	CHECK_EQ(abort_of(b, 0x70, 0, 0, 0), 0x05040001);
	CHECK(terminal_sdo(b, UPLOAD, 0x1008, 0, 0, a) > 0);
	CHECK_EQ(abort_of(b, 0x70, 0, 0, 0), 0x05030000); /* the toggle bit is wrong */
	bench_destroy(b);
}

TEST(sim_coe, complete_access_reads_an_object_as_a_whole)
{
	struct bench *b = in_preop(BOX);
	uint8_t a[BOX];

	CHECK_EQ(terminal_sdo(b, UPLOAD_ALL, 0x1c12, 0, 0, a), 10 + 6);
	CHECK_EQ(a[2], 0x51);
	CHECK_EQ(get_le32(a + 6), 6);
	CHECK_MEM(a + 10, ((uint8_t[]){ 2, 0, 0x00, 0x16, 0x01, 0x16 }), 6);
	CHECK_EQ(terminal_sdo(b, UPLOAD_ALL, 0x1c12, 1, 0, a), 10);
	CHECK_EQ(a[2], 0x53);
	CHECK_EQ(get_le32(a + 6), 0x16011600);
	CHECK_EQ(abort_of(b, UPLOAD_ALL, 0x1008, 0, 0), 0x06010000);
	CHECK_EQ(abort_of(b, UPLOAD_ALL, 0x1c12, 2, 0), 0x06010000);
	bench_destroy(b);
}

TEST(sim_coe, complete_access_writes_an_assignment_as_a_whole)
{
	struct bench *b = in_preop(BOX);
	uint8_t request[14] = { 0x00, 0x20, 0x31, 0x13, 0x1c, 0, 4, 0, 0, 0, 1, 0, 0x01, 0x1a };
	uint8_t header;
	uint8_t a[BOX];

	CHECK_EQ(terminal_put(b, 3, 0, request, sizeof(request)), 1);
	CHECK_EQ(terminal_take(b, &header, a, sizeof(a)), 10);
	CHECK_EQ(a[2], 0x70);
	CHECK_EQ(upload(b, 0x1c13, 0), 1);
	CHECK_EQ(upload(b, 0x1c13, 1), 0x1a01);
	request[6] = 2; /* says two bytes, and a count of one that needs four */
	CHECK_EQ(terminal_put(b, 3, 0, request, sizeof(request)), 1);
	CHECK_EQ(terminal_take(b, &header, a, sizeof(a)), 10);
	CHECK_EQ(get_le32(a + 6), 0x06070010);
	bench_destroy(b);
}

TEST(sim_coe, a_request_with_the_counter_of_the_one_before_is_not_executed_again)
{
	struct bench *b = in_preop(BOX);
	uint8_t write[10] = { 0x00, 0x20, DOWNLOAD_2, 0x00, 0x70, 1, 0x11, 0x11 };
	uint8_t first;
	uint8_t second;
	uint8_t a[BOX];

	CHECK_EQ(terminal_put(b, 3, 4, write, sizeof(write)), 1);
	CHECK_EQ(terminal_take(b, &first, a, sizeof(a)), 10);
	write[6] = 0x22;
	CHECK_EQ(terminal_put(b, 3, 4, write, sizeof(write)), 1);
	CHECK_EQ(terminal_take(b, &second, a, sizeof(a)), 10);
	CHECK_EQ(second, first);
	CHECK_EQ(upload(b, 0x7000, 1), 0x1111);
	/* Counter 0 is nobody's repetition. */
	CHECK_EQ(terminal_put(b, 3, 0, write, sizeof(write)), 1);
	CHECK_EQ(terminal_take(b, &second, a, sizeof(a)), 10);
	write[6] = 0x33;
	CHECK_EQ(terminal_put(b, 3, 0, write, sizeof(write)), 1);
	CHECK_EQ(terminal_take(b, &second, a, sizeof(a)), 10);
	CHECK_EQ(upload(b, 0x7000, 1), 0x1133);
	bench_destroy(b);
}

TEST(sim_coe, a_repeat_request_brings_the_last_answer_back_and_is_acknowledged)
{
	const uint16_t activate = ESC_REG_SM + ESC_SM_BYTES + 6;
	struct bench *b = in_preop(BOX);
	uint8_t again[BOX];
	uint8_t a[BOX];
	uint8_t header;

	CHECK_EQ(terminal_sdo(b, UPLOAD, 0x1018, 4, 0, a), 10);
	bench_write8(b, STATION, activate, 0x03);
	CHECK_EQ(terminal_take(b, &header, again, sizeof(again)), 10);
	CHECK_MEM(again, a, 10);
	CHECK_EQ(bench_read8(b, STATION, activate + 1), 0x02);
	CHECK_EQ(terminal_take(b, &header, again, sizeof(again)), -1);
	bench_write8(b, STATION, activate, 0x01);
	CHECK_EQ(terminal_take(b, &header, again, sizeof(again)), 10);
	CHECK_EQ(bench_read8(b, STATION, activate + 1), 0x00);
	bench_destroy(b);
}

TEST(sim_coe, an_answer_waits_until_the_one_before_is_taken)
{
	struct bench *b = in_preop(BOX);
	uint8_t read[10] = { 0x00, 0x20, UPLOAD, 0x18, 0x10, 1 };
	uint8_t header;
	uint8_t a[BOX];

	CHECK_EQ(terminal_put(b, 3, 1, read, sizeof(read)), 1);
	bench_wait(b, 2000000);
	read[5] = 2;
	CHECK_EQ(terminal_put(b, 3, 2, read, sizeof(read)), 1);
	CHECK_EQ(terminal_take(b, &header, a, sizeof(a)), 10);
	CHECK_EQ(a[5], 1);
	CHECK_EQ(terminal_take(b, &header, a, sizeof(a)), 10);
	CHECK_EQ(a[5], 2);
	bench_destroy(b);
}

TEST(sim_coe, other_protocols_and_wrong_lengths_get_a_mailbox_error)
{
	struct bench *b = in_preop(BOX);
	uint8_t data[2] = { 0, 0 };
	uint8_t box[BOX] = { 0xff, 0x00, 0, 0, 0, 0x23 };
	uint8_t header;
	uint8_t a[BOX];

	CHECK_EQ(terminal_put(b, 2, 1, data, sizeof(data)), 1); /* EoE */
	CHECK_EQ(terminal_take(b, &header, a, sizeof(a)), 4);
	CHECK_EQ(header & 0x0f, 0);
	CHECK_EQ(get_le16(a), 1);
	CHECK_EQ(get_le16(a + 2), 2);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, STATION, TERMINAL_MAILBOX_OUT, box, BOX), 1);
	CHECK_EQ(terminal_take(b, &header, a, sizeof(a)), 4);
	CHECK_EQ(get_le16(a + 2), 8);
	/* A CoE header cut short is answered by nothing, and does no harm. */
	CHECK_EQ(terminal_put(b, 3, 0, data, 1), 1);
	CHECK_EQ(terminal_take(b, &header, a, sizeof(a)), -1);
	CHECK_EQ(upload(b, 0x1018, 4), 4711);
	bench_destroy(b);
}

TEST(sim_coe, sdo_information_is_refused_by_its_own_error)
{
	struct bench *b = in_preop(BOX);
	uint8_t list[8] = { 0x00, 0x80, 1 };
	uint8_t header;
	uint8_t a[BOX];

	CHECK_EQ(terminal_put(b, 3, 0, list, sizeof(list)), 1);
	CHECK_EQ(terminal_take(b, &header, a, sizeof(a)), 10);
	CHECK_EQ(get_le16(a) >> 12, 8);
	CHECK_EQ(a[2], 7);
	CHECK_EQ(get_le32(a + 6), 0x06010000);
	bench_destroy(b);
}

TEST(sim_coe, any_request_at_all_is_survived)
{
	struct bench *b = in_preop(BOX);
	uint32_t state = 12345;

	for (int i = 0; i < 3000; i++) {
		uint8_t request[40];
		uint8_t header;
		uint8_t a[BOX];
		size_t len = (size_t)(i % 40) + 1;

		for (size_t k = 0; k < sizeof(request); k++) {
			state = state * 1664525 + 1013904223;
			request[k] = (uint8_t)(state >> 24);
		}
		request[1] = (uint8_t)(i % 3 == 0 ? request[1] : 0x20);
		CHECK_EQ(terminal_put(b, 3, 0, request, len < sizeof(request) ? len : 40), 1);
		(void)terminal_take(b, &header, a, sizeof(a));
	}
	bench_destroy(b);
}
