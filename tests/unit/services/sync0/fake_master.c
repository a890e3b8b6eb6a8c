/* SPDX-License-Identifier: MIT */
#include "unit/services/sync0/fake_master.h"

#include <stdio.h>
#include <string.h>

#include "base/limits.h"
#include "base/sample.h"
#include "harness/test.h"

enum { OUTPUT_BYTES = 9, SHOT_BIT = 8, ROUND_TRIP_NS = 20000, SLOTS = 8192 };

int64_t fake_mono_ns(int64_t dc_ns)
{
	return FAKE_MONO0_NS + dc_ns - FAKE_DC0_NS;
}

static struct slave_info slave_at(const struct fake_master *fm, uint16_t pos)
{
	struct slave_info slave = { .slave_pos = pos,
				    .has_dc = 1,
				    .sync0_cycle_ns = (uint32_t)fm->period_ns,
				    .config_item = (uint16_t)(pos + 1) };

	snprintf(slave.name, sizeof(slave.name), pos < 26 ? "%c" : "slave%u",
		 pos < 26 ? 'a' + pos : pos);
	if (pos == FAKE_SHOT_SLAVE) {
		slave.config_item = (uint16_t)(slave.config_item + fm->absent);
		slave.sync0_shift_ns = fm->shift_ns;
		slave.sync0_cycle_ns = fm->has_own_cycle ? fm->cycle_ns : slave.sync0_cycle_ns;
	}
	return slave;
}

void fake_master_start(struct fake_master *fm, const char *dir, int64_t period_ns)
{
	static const struct channel shot = { .name = "b.oneshot_time",
					     .slave_pos = FAKE_SHOT_SLAVE,
					     .index = 0x7000,
					     .subindex = 2,
					     .type = CHANNEL_UINT,
					     .direction = CHANNEL_OUTPUT,
					     .bit_len = 64,
					     .bit_offset = SHOT_BIT,
					     .scale = 1 };
	struct {
		struct sample_meta meta;
		struct slave_info slave[LIMIT_SLAVES];
		struct channel room;
	} m = { .meta = { .version = SAMPLE_VERSION,
			  .slave_count = FAKE_SLAVES + fm->more,
			  .channel_count = 1,
			  .image_bytes = OUTPUT_BYTES,
			  .output_bytes = OUTPUT_BYTES,
			  .period_ns = (uint64_t)period_ns,
			  .session = 7 } };
	const struct ring_spec spec = {
		.path = fm->path,
		.kind = "sample",
		.payload_bytes = sample_head_bytes(m.meta.slave_count) + OUTPUT_BYTES,
		.slot_count = SLOTS,
		.meta = &m,
		.meta_bytes =
			sizeof(m.meta) + m.meta.slave_count * sizeof(m.slave[0]) + sizeof(shot),
		.period_ns = (uint64_t)period_ns,
		.file_mode = 0600,
	};

	snprintf(fm->path, sizeof(fm->path), "%s/samples", dir);
	fm->period_ns = period_ns;
	for (uint16_t pos = 0; pos < m.meta.slave_count; pos++) {
		m.slave[pos] = slave_at(fm, pos);
	}
	memcpy(&m.slave[m.meta.slave_count], &shot, sizeof(shot));
	fm->cycle = 0;
	fm->dc_ns = fm->dc_ns == 0 ? FAKE_DC0_NS : fm->dc_ns;
	CHECK_EQ(ring_create(&spec, &fm->ring), 0);
}

void fake_master_stop(struct fake_master *fm)
{
	ring_destroy(fm->ring);
	fm->ring = NULL;
}

void fake_master_push(struct fake_master *fm, uint64_t shot_ns)
{
	int64_t frame_ns = fm->dc_ns + fm->period_ns / 2;
	struct sample_header h = {
		.cycle = (uint64_t)fm->cycle++,
		.dc_time_ns = fm->dc_ns,
		.frame_dc_ns = frame_ns,
		.wake_mono_ns = fake_mono_ns(frame_ns) - ROUND_TRIP_NS / 2,
		.round_trip_ns = ROUND_TRIP_NS,
	};
	uint8_t image[OUTPUT_BYTES] = { 0 };

	for (int i = 0; i < 8; i++) {
		image[SHOT_BIT / 8 + i] = (uint8_t)(shot_ns >> (8 * i));
	}
	ring_push(fm->ring, &h, sample_head_bytes(FAKE_SLAVES + fm->more), image, sizeof(image));
	fm->dc_ns += fm->period_ns;
}
