/* SPDX-License-Identifier: MIT */
/* What the sample ring says of one-shot times. */
#include "sync0/master.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/ring.h"
#include "harness/test.h"

enum { OUTPUT_BYTES = 9, SHOT_BIT = 8, SLAVE = 1 };

#define DC0_NS INT64_C(845000000000000000)
#define PERIOD_NS INT64_C(1000000)

/* A ring as ecdaqd makes it: two slaves, the second with a shot's time. */
struct fake_master {
	char dir[64];
	char path[96];
	struct ring *ring;
	struct master *master;
	int64_t cycle;
};

static void open_ring(struct fake_master *fm)
{
	struct {
		struct sample_meta meta;
		struct slave_info slave[2];
		struct channel channel;
	} m = {
		.meta = { .version = SAMPLE_VERSION,
			  .slave_count = 2,
			  .channel_count = 1,
			  .image_bytes = OUTPUT_BYTES,
			  .output_bytes = OUTPUT_BYTES,
			  .period_ns = (uint64_t)PERIOD_NS,
			  .session = 7 },
		.slave = { { .slave_pos = 0 }, { .slave_pos = SLAVE } },
		.channel = { .name = "b.oneshot_time",
			     .slave_pos = SLAVE,
			     .index = 0x7000,
			     .subindex = 2,
			     .type = CHANNEL_UINT,
			     .direction = CHANNEL_OUTPUT,
			     .bit_len = 64,
			     .bit_offset = SHOT_BIT,
			     .scale = 1 },
	};
	const struct ring_spec spec = {
		.path = fm->path,
		.kind = "sample",
		.payload_bytes = sizeof(struct sample_header) + OUTPUT_BYTES,
		.slot_count = 64,
		.meta = &m,
		.meta_bytes = sizeof(m),
		.period_ns = (uint64_t)PERIOD_NS,
		.file_mode = 0600,
	};

	CHECK_EQ(ring_create(&spec, &fm->ring), 0);
}

static void fake_open(struct fake_master *fm)
{
	*fm = (struct fake_master){ .dir = "/tmp/ecdaq-master-XXXXXX" };
	CHECK(mkdtemp(fm->dir) != NULL);
	snprintf(fm->path, sizeof(fm->path), "%s/samples", fm->dir);
	open_ring(fm);
	fm->master = master_create(fm->path);
	CHECK(fm->master != NULL);
}

static void fake_close(struct fake_master *fm)
{
	master_destroy(fm->master);
	ring_destroy(fm->ring);
	unlink(fm->path);
	rmdir(fm->dir);
}

static void push(struct fake_master *fm, uint64_t shot_ns)
{
	struct sample_header h = { .cycle = (uint64_t)fm->cycle,
				   .dc_time_ns = DC0_NS + fm->cycle * PERIOD_NS };
	uint8_t image[OUTPUT_BYTES] = { 0 };

	for (int i = 0; i < 8; i++) {
		image[1 + i] = (uint8_t)(shot_ns >> (8 * i));
	}
	ring_push(fm->ring, &h, sizeof(h), image, sizeof(image));
	fm->cycle++;
}

static size_t next(struct fake_master *fm, struct master_item *ret)
{
	CHECK_EQ(master_next(fm->master, ret), 1);
	CHECK_EQ(ret->cycle.due_dc_ns, DC0_NS + ret->cycle.cycle * PERIOD_NS);
	return ret->shots;
}

TEST(sync0, a_shot_is_every_change_of_its_time_in_the_ring)
{
	struct fake_master fm;
	struct master_item item;
	uint64_t at_ns = (uint64_t)(DC0_NS + 50 * PERIOD_NS);

	fake_open(&fm);
	push(&fm, 0);
	push(&fm, at_ns);
	push(&fm, at_ns);
	push(&fm, 0);
	push(&fm, UINT64_MAX);
	CHECK_EQ(master_open(fm.master), 1);
	master_watch_shots(fm.master, UINT64_C(1) << SLAVE);
	CHECK_EQ(next(&fm, &item), 0);
	CHECK_EQ(next(&fm, &item), 1);
	CHECK_EQ(item.shot[0].slave_pos, SLAVE);
	CHECK_EQ(item.shot[0].dc_ns, at_ns);
	CHECK_EQ(next(&fm, &item), 0);
	CHECK_EQ(next(&fm, &item), 1);
	CHECK_EQ(item.shot[0].dc_ns, 0);
	CHECK_EQ(next(&fm, &item), 1);
	CHECK_EQ(item.shot[0].dc_ns, 0);
	CHECK_EQ(master_next(fm.master, &item), 0);
	fake_close(&fm);
}

TEST(sync0, a_shot_that_was_armed_before_the_first_look_is_known)
{
	struct fake_master fm;
	struct master_item item;
	uint64_t at_ns = (uint64_t)(DC0_NS + 50 * PERIOD_NS);

	fake_open(&fm);
	push(&fm, at_ns);
	push(&fm, at_ns);
	CHECK_EQ(master_open(fm.master), 1);
	master_watch_shots(fm.master, UINT64_C(1) << SLAVE);
	CHECK_EQ(next(&fm, &item), 1);
	CHECK_EQ(item.shot[0].dc_ns, at_ns);
	CHECK_EQ(next(&fm, &item), 0);
	fake_close(&fm);
}

TEST(sync0, shots_of_a_slave_that_is_not_in_one_shot_mode_are_not_looked_for)
{
	struct fake_master fm;
	struct master_item item;

	fake_open(&fm);
	push(&fm, (uint64_t)(DC0_NS + 50 * PERIOD_NS));
	CHECK_EQ(master_open(fm.master), 1);
	master_watch_shots(fm.master, UINT64_C(1) << 0);
	CHECK_EQ(next(&fm, &item), 0);
	fake_close(&fm);
}
