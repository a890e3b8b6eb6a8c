/* SPDX-License-Identifier: MIT */
/* The object dictionary through SDO. */
#include "base/bytes.h"
#include "board.h"
#include "firmware/fb1111_piccolo/objects.h"
#include "harness/test.h"
#include "wire/al.h"

static uint64_t number(struct board *b, uint16_t index, uint8_t subindex)
{
	uint8_t data[128] = { 0 };
	size_t len = 0;

	CHECK_EQ(board_sdo_read(b, index, subindex, data, &len), 0);
	CHECK(len <= 8);
	return get_le64(data);
}

static uint32_t read_abort(struct board *b, uint16_t index, uint8_t subindex)
{
	uint8_t data[128];
	size_t len = 77;
	uint32_t abort = board_sdo_read(b, index, subindex, data, &len);

	CHECK(abort == 0 || len == 77);
	return abort;
}

TEST(firmware, every_object_of_the_table_reads_with_its_length)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	for (uint16_t i = 0; i < piccolo_object_count; i++) {
		const struct piccolo_object *o = &piccolo_objects[i];
		uint8_t data[128];
		size_t len;

		CHECK_EQ(board_sdo_read(&b, o->index, o->subindex, data, &len), 0);
		if (o->type != PICCOLO_STRING) {
			CHECK_EQ(len, piccolo_type_octets(o->type));
		}
	}
	CHECK_EQ(board_breaches(&b), 0);
}

TEST(firmware, objects_are_sorted_and_named_and_subindex_0_comes_first)
{
	for (uint16_t i = 0; i < piccolo_object_count; i++) {
		const struct piccolo_object *o = &piccolo_objects[i];

		CHECK(o->name != NULL && o->name[0] != '\0');
		CHECK(piccolo_type_octets(o->type) <= 4 || o->access == ACCESS_RO);
		if (i > 0) {
			const struct piccolo_object *last = o - 1;

			CHECK((last->index << 8 | last->subindex) < (o->index << 8 | o->subindex));
			CHECK(last->index == o->index || o->subindex == 0);
		}
	}
}

TEST(firmware, identity_and_names_are_those_of_the_board)
{
	struct board b;
	uint8_t data[128];
	size_t len;

	board_lead_to(&b, PICCOLO_PREOP);
	CHECK_EQ(number(&b, 0x1018, 1), 0x00000002);
	CHECK_EQ(number(&b, 0x1018, 2), 0x04570862);
	CHECK_EQ(number(&b, 0x1018, 3), 0x0258008d);
	CHECK_EQ(board_sdo_read(&b, 0x1008, 0, data, &len), 0);
	CHECK_EQ(len, 14);
	CHECK_MEM(data, "FB1111-Piccolo", 14);
}

TEST(firmware, mapping_objects_describe_the_process_data)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	CHECK_EQ(number(&b, 0x1c00, 0), 4);
	CHECK_EQ(number(&b, 0x1c00, 3), 3);
	CHECK_EQ(number(&b, 0x1c00, 4), 4);
	CHECK_EQ(number(&b, 0x1c12, 0), 1);
	CHECK_EQ(number(&b, 0x1c12, 1), 0x1600);
	CHECK_EQ(number(&b, 0x1c13, 1), 0x1a00);
	CHECK_EQ(number(&b, 0x1600, 0), 3);
	CHECK_EQ(number(&b, 0x1600, 1), 0x70000101);
	CHECK_EQ(number(&b, 0x1600, 2), 0x00000007);
	CHECK_EQ(number(&b, 0x1600, 3), 0x70000240);
	CHECK_EQ(number(&b, 0x1a00, 0), 4);
	CHECK_EQ(number(&b, 0x1a00, 1), 0x60000110);
	CHECK_EQ(number(&b, 0x1a00, 2), 0x60000210);
	CHECK_EQ(number(&b, 0x1a00, 3), 0x60000340);
	CHECK_EQ(number(&b, 0x1a00, 4), 0x60000408);
}

TEST(firmware, live_values_and_sync_parameters_follow_the_process)
{
	struct board b;

	board_lead_to(&b, PICCOLO_OP);
	board_master_outputs(&b, 1, 42);
	board_run(&b, 12000);
	b.adc = 4095;
	board_sync0(&b, 5000000);
	CHECK_EQ(number(&b, 0x6000, 1), 4095);
	CHECK_EQ(number(&b, 0x6000, 2), 2);
	CHECK_EQ(number(&b, 0x6000, 3), 5000000);
	CHECK_EQ(number(&b, 0x6000, 4), PICCOLO_STATUS_OVERRUN);
	CHECK_EQ(number(&b, 0x1c33, 0x0c), 1);
	CHECK_EQ(number(&b, 0x1c32, 1), 2);
	CHECK_EQ(number(&b, 0x1c32, 2), 1000000);
	CHECK_EQ(number(&b, 0x1c33, 5), 100000);
	CHECK_EQ(number(&b, 0x7000, 1), 1);
	CHECK_EQ(number(&b, 0x7000, 2), 42);
}

TEST(firmware, what_does_not_exist_is_aborted_with_the_right_code)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	CHECK_EQ(read_abort(&b, 0x1001, 0), 0x06020000);
	CHECK_EQ(read_abort(&b, 0xffff, 0xff), 0x06020000);
	CHECK_EQ(read_abort(&b, 0x1018, 5), 0x06090011);
	CHECK_EQ(read_abort(&b, 0x1000, 1), 0x06090011);
	CHECK_EQ(read_abort(&b, 0x1c32, 3), 0x06090011);
	CHECK_EQ(board_sdo_write(&b, 0x2000, 0, 0, 1), 0x06020000);
	CHECK_EQ(board_sdo_write(&b, 0x8000, 3, 0, 1), 0x06090011);
	CHECK_EQ(read_abort(&b, 0x8000, 2), 0);
}

TEST(firmware, writes_are_checked_for_access_length_value_and_state)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	CHECK_EQ(board_sdo_write(&b, 0x1018, 1, 2, 4), 0x06010002);
	CHECK_EQ(board_sdo_write(&b, 0x7000, 1, 1, 1), 0x06010002);
	CHECK_EQ(board_sdo_write(&b, 0x8000, 1, 1, 2), 0x06070010);
	CHECK_EQ(board_sdo_write(&b, 0x8000, 2, 1, 1), 0x06070010);
	CHECK_EQ(board_sdo_write(&b, 0x8000, 1, 2, 1), 0x06090030);
	CHECK_EQ(board_sdo_write(&b, 0x8000, 2, 0, 2), 0x06090030);
	CHECK_EQ(board_sdo_write(&b, 0x8000, 2, 1001, 2), 0x06090030);
	CHECK_EQ(b.fw.mode, PICCOLO_PERIODIC);
	CHECK_EQ(b.fw.refresh_ms, 10);
	CHECK_EQ(board_sdo_write(&b, 0x8000, 2, 1000, 2), 0);
	CHECK_EQ(number(&b, 0x8000, 2), 1000);

	CHECK_EQ(board_master_request(&b, AL_SAFEOP), AL_SAFEOP);
	CHECK_EQ(board_sdo_write(&b, 0x8000, 1, 1, 1), 0x08000022);
	CHECK_EQ(board_sdo_write(&b, 0x1c12, 0, 1, 1), 0x08000022);
	CHECK_EQ(board_sdo_write(&b, 0x8000, 2, 5, 2), 0);
}

TEST(firmware, the_fixed_assignment_can_be_written_as_it_is)
{
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	CHECK_EQ(board_sdo_write(&b, 0x1c12, 0, 0, 1), 0);
	CHECK_EQ(board_master_request(&b, AL_SAFEOP), AL_PREOP | AL_ERROR);
	CHECK_EQ(board_al_code(&b), AL_CODE_INVALID_OUTPUT_CONFIG);
	CHECK_EQ(board_sdo_write(&b, 0x1c12, 1, 0x1600, 2), 0);
	CHECK_EQ(board_sdo_write(&b, 0x1c12, 1, 0x1601, 2), 0x06040041);
	CHECK_EQ(board_sdo_write(&b, 0x1c12, 0, 2, 1), 0x06090030);
	CHECK_EQ(board_sdo_write(&b, 0x1c12, 0, 1, 1), 0);
	CHECK_EQ(board_sdo_write(&b, 0x1c13, 1, 0x1600, 2), 0x06040041);
	CHECK_EQ(board_sdo_write(&b, 0x1c32, 1, 2, 2), 0);
	CHECK_EQ(board_sdo_write(&b, 0x1c32, 1, 1, 2), 0x06090030);
	CHECK_EQ(board_master_request(&b, AL_SAFEOP | AL_ERROR), AL_SAFEOP);
}

static uint32_t raw(struct board *b, const uint8_t *request, size_t len)
{
	uint8_t answer[128];

	b->master_counter = b->master_counter % 7 + 1;
	board_mailbox_put(b, 3, (uint8_t)b->master_counter, request, len);
	CHECK_EQ(board_mailbox_take(b, answer), 0);
	return answer[6 + 2] == 0x80 ? get_le32(answer + 12) : 0;
}

TEST(firmware, complete_access_segments_and_nonsense_are_aborted)
{
	static const uint8_t complete[10] = { 0x00, 0x20, 0x50, 0x18, 0x10, 0 };
	static const uint8_t complete_write[10] = { 0x00, 0x20, 0x31, 0x12, 0x1c, 0 };
	static const uint8_t upload_segment[10] = { 0x00, 0x20, 0x60, 0x18, 0x10, 0 };
	static const uint8_t download_segment[10] = { 0x00, 0x20, 0x01, 0x18, 0x10, 0 };
	static const uint8_t nonsense[10] = { 0x00, 0x20, 0xe0, 0x18, 0x10, 0 };
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	CHECK_EQ(raw(&b, complete, 10), 0x06010000);
	CHECK_EQ(raw(&b, complete_write, 10), 0x06010000);
	CHECK_EQ(raw(&b, upload_segment, 10), 0x05040001);
	CHECK_EQ(raw(&b, download_segment, 10), 0x05040001);
	CHECK_EQ(raw(&b, nonsense, 10), 0x05040001);
}

TEST(firmware, normal_downloads_are_bounded_by_what_the_mailbox_holds)
{
	/* 0x8000:02, normal transfer: the size says 2, 3 or far more than came */
	uint8_t request[12] = { 0x00, 0x20, 0x21, 0x00, 0x80, 2, 2, 0, 0, 0, 15, 0 };
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	CHECK_EQ(raw(&b, request, 12), 0);
	CHECK_EQ(b.fw.refresh_ms, 15);
	CHECK_EQ(raw(&b, request, 11), 0x06070010);
	CHECK_EQ(raw(&b, request, 10), 0x06070010);
	request[6] = 3;
	CHECK_EQ(raw(&b, request, 12), 0x06070010);
	put_le32(request + 6, 0xffffffff);
	CHECK_EQ(raw(&b, request, 12), 0x06070010);
	CHECK_EQ(b.fw.refresh_ms, 15);
}

TEST(firmware, an_expedited_download_without_size_takes_the_objects_length)
{
	static const uint8_t request[10] = { 0x00, 0x20, 0x22, 0x00, 0x80, 2, 44, 0, 0xaa, 0xaa };
	struct board b;

	board_lead_to(&b, PICCOLO_PREOP);
	CHECK_EQ(raw(&b, request, 10), 0);
	CHECK_EQ(b.fw.refresh_ms, 44);
}

TEST(firmware, an_abort_of_the_master_is_not_answered)
{
	static const uint8_t request[10] = { 0x00, 0x20, 0x80, 0x00, 0x80, 2 };
	struct board b;
	uint8_t answer[128];

	board_lead_to(&b, PICCOLO_PREOP);
	b.master_counter = 1;
	board_mailbox_put(&b, 3, 1, request, 10);
	CHECK_EQ(board_mailbox_take(&b, answer), -1);
	CHECK(!b.is_sm0_full);
	CHECK_EQ(number(&b, 0x8000, 2), 10);
}
