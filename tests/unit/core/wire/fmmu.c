/* SPDX-License-Identifier: MIT */
#include "wire/fmmu.h"

#include "harness/test.h"
#include "wire/datagram.h"

TEST(fmmu, registers_are_decoded)
{
	static const uint8_t raw[ESC_FMMU_BYTES] = { 0x78, 0x56, 0x34, 0x12, 0x02, 0x01, 0xfb,
						     0x0e, 0x00, 0x11, 0x0a, 0x02, 0x01 };
	struct fmmu found = fmmu_parse(raw);

	CHECK_EQ(found.logical, 0x12345678);
	CHECK_EQ(found.bytes, 0x0102);
	CHECK_EQ(found.start_bit, 3);
	CHECK_EQ(found.stop_bit, 6);
	CHECK_EQ(found.physical, 0x1100);
	CHECK_EQ(found.physical_bit, 2);
	CHECK_EQ(found.is_read, 0);
	CHECK_EQ(found.is_write, 1);
	CHECK_EQ(found.is_active, 1);
}

TEST(fmmu, sync_managers_are_decoded)
{
	static const uint8_t mailbox[ESC_SM_BYTES] = { 0x00, 0x10, 0x80, 0x00, 0x26, 0, 1, 0 };
	static const uint8_t inputs[ESC_SM_BYTES] = { 0x00, 0x14, 0x0d, 0x00, 0x20, 0, 0, 0 };
	static const uint8_t outputs[ESC_SM_BYTES] = { 0x00, 0x11, 0x09, 0x00, 0x64, 0, 1, 0 };
	struct sync_manager sm = sync_manager_parse(mailbox);

	CHECK_EQ(sm.start, 0x1000);
	CHECK_EQ(sm.bytes, 0x80);
	CHECK_EQ(sm.is_mailbox + 2 * sm.is_write + 4 * sm.has_watchdog + 8 * sm.is_active, 11);
	sm = sync_manager_parse(inputs);
	CHECK_EQ(sm.bytes, 13);
	CHECK_EQ(sm.is_mailbox + 2 * sm.is_write + 4 * sm.has_watchdog + 8 * sm.is_active, 0);
	sm = sync_manager_parse(outputs);
	CHECK_EQ(sm.is_mailbox + 2 * sm.is_write + 4 * sm.has_watchdog + 8 * sm.is_active, 14);
}

TEST(fmmu, a_slave_adds_once_for_reading_and_twice_for_writing_by_lrw)
{
	const struct fmmu fmmu[] = {
		{ .logical = 0, .bytes = 9, .is_write = 1, .is_active = 1 },
		{ .logical = 9, .bytes = 9, .is_write = 1, .is_active = 1 },
		{ .logical = 18, .bytes = 13, .is_read = 1, .is_active = 1 },
		{ .logical = 31, .bytes = 13, .is_read = 1 }, /* off */
	};

	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRW, 0, 44, fmmu, 4), 3);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRW, 0, 18, fmmu, 4), 2);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRW, 18, 26, fmmu, 4), 1);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRD, 0, 44, fmmu, 4), 1);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LWR, 0, 44, fmmu, 4), 1);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRD, 0, 18, fmmu, 4), 0);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRW, 31, 13, fmmu, 4), 0);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRW, 44, 100, fmmu, 4), 0);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_FPRD, 0, 44, fmmu, 4), 0);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRW, 0, 44, fmmu, 0), 0);
}

TEST(fmmu, addresses_at_the_end_of_the_space_do_not_wrap)
{
	const struct fmmu fmmu = {
		.logical = UINT32_MAX, .bytes = UINT16_MAX, .is_read = 1, .is_active = 1
	};

	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRD, 0, 44, &fmmu, 1), 0);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRD, UINT32_MAX, 1, &fmmu, 1), 1);
	CHECK_EQ(fmmu_wkc(ECAT_CMD_LRD, UINT32_MAX, UINT32_MAX, &fmmu, 1), 1);
}
