/* SPDX-License-Identifier: MIT */
#include "wire/fmmu.h"

#include "base/bytes.h"
#include "wire/datagram.h"

enum {
	FMMU_READ = 0x01,
	FMMU_WRITE = 0x02,
	BIT_MASK = 0x07,
	SM_MODE_MASK = 0x03,
	SM_MODE_MAILBOX = 0x02,
	SM_WRITE = 0x04, /* of the direction, bits 2 and 3 */
	SM_WATCHDOG = 0x40,
	ACTIVE = 0x01,
	WKC_READ = 1,
	WKC_WRITE = 2, /* in LRW */
};

struct fmmu fmmu_parse(const uint8_t raw[ESC_FMMU_BYTES])
{
	return (struct fmmu){
		.logical = get_le32(raw),
		.bytes = get_le16(raw + 4),
		.start_bit = raw[6] & BIT_MASK,
		.stop_bit = raw[7] & BIT_MASK,
		.physical = get_le16(raw + 8),
		.physical_bit = raw[10] & BIT_MASK,
		.is_read = (raw[11] & FMMU_READ) != 0,
		.is_write = (raw[11] & FMMU_WRITE) != 0,
		.is_active = (raw[12] & ACTIVE) != 0,
	};
}

struct sync_manager sync_manager_parse(const uint8_t raw[ESC_SM_BYTES])
{
	return (struct sync_manager){
		.start = get_le16(raw),
		.bytes = get_le16(raw + 2),
		.is_mailbox = (raw[4] & SM_MODE_MASK) == SM_MODE_MAILBOX,
		.is_write = (raw[4] & SM_WRITE) != 0,
		.has_watchdog = (raw[4] & SM_WATCHDOG) != 0,
		.is_active = (raw[6] & ACTIVE) != 0,
	};
}

static int overlaps(const struct fmmu *fmmu, uint32_t start, uint32_t len)
{
	return fmmu->is_active && fmmu->logical < (uint64_t)start + len &&
	       start < (uint64_t)fmmu->logical + fmmu->bytes;
}

unsigned fmmu_wkc(uint8_t cmd, uint32_t start, uint32_t len, const struct fmmu *fmmu, size_t count)
{
	int is_read = 0;
	int is_written = 0;

	for (size_t i = 0; i < count; i++) {
		if (overlaps(&fmmu[i], start, len)) {
			is_read |= fmmu[i].is_read;
			is_written |= fmmu[i].is_write;
		}
	}
	switch (cmd) {
	case ECAT_CMD_LRD:
		return is_read ? WKC_READ : 0;
	case ECAT_CMD_LWR:
		return is_written ? 1 : 0;
	case ECAT_CMD_LRW:
		return (is_read ? WKC_READ : 0u) + (is_written ? WKC_WRITE : 0u);
	default: /* not logical */
		return 0;
	}
}
