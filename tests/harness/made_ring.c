/* SPDX-License-Identifier: MIT */
#include "harness/made_ring.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include "base/bytes.h"
#include "harness/test.h"

static struct channel channel(const char *name, unsigned pos, enum channel_direction direction,
			      unsigned bits, unsigned offset)
{
	struct channel ch = { .slave_pos = (uint16_t)pos,
			      .type = bits == 1 ? CHANNEL_BOOL : CHANNEL_UINT,
			      .direction = (uint8_t)direction,
			      .bit_len = (uint8_t)bits,
			      .bit_offset = offset,
			      .scale = 1 };

	snprintf(ch.name, sizeof(ch.name), "%s", name);
	return ch;
}

struct made_meta made_meta(void)
{
	return (struct made_meta){
		.head = { .version = SAMPLE_VERSION,
			  .slave_count = MADE_SLAVES,
			  .channel_count = MADE_CHANNELS,
			  .image_bytes = MADE_IMAGE_BYTES,
			  .output_bytes = MADE_OUTPUT_BYTES,
			  .period_ns = MADE_PERIOD_NS,
			  .session = MADE_SESSION },
		.slave = { { .name = "a", .device = "A", .slave_pos = 0, .counter_channel = 2 },
			   { .name = "b", .device = "B", .slave_pos = 1, .counter_channel = -1 } },
		.channel = { channel("b.led", 1, CHANNEL_OUTPUT, 1, 0),
			     channel("a.adc", 0, CHANNEL_INPUT, 16, 8),
			     channel("a.counter", 0, CHANNEL_INPUT, 16, 24),
			     channel("b.adc", 1, CHANNEL_INPUT, 16, 40) },
	};
}

const char *made_path(const char *name)
{
	static char path[128];

	snprintf(path, sizeof(path), "/dev/shm/ecdaq-test-%s-%d", name, (int)getpid());
	return path;
}

struct ring *made_ring(const char *path, const struct made_meta *meta, uint64_t slots)
{
	const struct ring_spec spec = {
		.path = path,
		.kind = "sample",
		.payload_bytes = sample_head_bytes(MADE_SLAVES) + MADE_IMAGE_BYTES,
		.slot_count = slots,
		.meta = meta,
		.meta_bytes = sizeof(*meta),
		.period_ns = MADE_PERIOD_NS,
		.file_mode = 0600,
	};
	struct ring *ring = NULL;

	CHECK_EQ(ring_create(&spec, &ring), 0);
	return ring;
}

void made_push(struct ring *ring, uint64_t cycle, uint64_t slaves_bad, uint32_t flags)
{
	struct sample_header h = {
		.cycle = cycle,
		.dc_time_ns = INT64_C(800000000000000000) + (int64_t)cycle * MADE_PERIOD_NS,
		.frame_dc_ns = INT64_C(800000000000500000) + (int64_t)cycle * MADE_PERIOD_NS,
		.wake_tai_ns = INT64_C(1767225600000450000) + (int64_t)cycle * MADE_PERIOD_NS,
		.round_trip_ns = 100000,
		.flags = flags,
		.slaves_bad = { .word = { slaves_bad } },
	};
	uint8_t image[MADE_IMAGE_BYTES] = { 0 };

	put_le16(image + 1, (uint16_t)(cycle + 100));
	put_le16(image + 3, (uint16_t)cycle);
	put_le16(image + 5, (uint16_t)(cycle + 200));
	ring_push(ring, &h, sample_head_bytes(MADE_SLAVES), image, sizeof(image));
}

void made_overwrite(const char *path, off_t offset, const void *bytes, size_t count)
{
	int fd = open(path, O_RDWR | O_CLOEXEC);

	CHECK(fd >= 0);
	CHECK_EQ(pwrite(fd, bytes, count, offset), count);
	close(fd);
}

void made_truncate(const char *path, off_t bytes)
{
	CHECK_EQ(truncate(path, bytes), 0);
}
