/* SPDX-License-Identifier: MIT */
/* What the sample ring says of one-shot times. */
#include "sync0/master.h"

#include <stdlib.h>
#include <unistd.h>

#include "harness/test.h"
#include "unit/services/sync0/fake_master.h"

#define PERIOD_NS INT64_C(1000000)

struct ring_bench {
	char dir[64];
	struct fake_master fake;
	struct master *master;
};

static void begin(struct ring_bench *b)
{
	*b = (struct ring_bench){ .dir = "/tmp/ecdaq-master-XXXXXX" };
	CHECK(mkdtemp(b->dir) != NULL);
	fake_master_start(&b->fake, b->dir, PERIOD_NS);
	b->master = master_create(b->fake.path);
	CHECK(b->master != NULL);
}

static void end(struct ring_bench *b)
{
	master_destroy(b->master);
	fake_master_stop(&b->fake);
	unlink(b->fake.path);
	rmdir(b->dir);
}

static size_t next(struct ring_bench *b, struct master_item *ret)
{
	CHECK_EQ(master_next(b->master, ret), 1);
	CHECK_EQ(ret->cycle.due_dc_ns, FAKE_DC0_NS + ret->cycle.cycle * PERIOD_NS);
	return ret->shots;
}

static void watch_shots_of(struct ring_bench *b, unsigned slave)
{
	struct slave_set slaves = slave_set_empty();

	slave_set_add(&slaves, slave);
	master_watch_shots(b->master, &slaves);
}

TEST(sync0, a_shot_is_every_change_of_its_time_in_the_ring)
{
	struct ring_bench b;
	struct master_item item;
	uint64_t at_ns = (uint64_t)(FAKE_DC0_NS + 50 * PERIOD_NS);

	begin(&b);
	fake_master_push(&b.fake, 0);
	fake_master_push(&b.fake, at_ns);
	fake_master_push(&b.fake, at_ns);
	fake_master_push(&b.fake, 0);
	fake_master_push(&b.fake, UINT64_MAX);
	CHECK_EQ(master_open(b.master), 1);
	watch_shots_of(&b, FAKE_SHOT_SLAVE);
	CHECK_EQ(next(&b, &item), 0);
	CHECK_EQ(next(&b, &item), 1);
	CHECK_EQ(item.shot[0].slave_pos, FAKE_SHOT_SLAVE);
	CHECK_EQ(item.shot[0].dc_ns, at_ns);
	CHECK_EQ(next(&b, &item), 0);
	CHECK_EQ(next(&b, &item), 1);
	CHECK_EQ(item.shot[0].dc_ns, 0);
	CHECK_EQ(next(&b, &item), 1);
	CHECK_EQ(item.shot[0].dc_ns, 0);
	CHECK_EQ(master_next(b.master, &item), 0);
	end(&b);
}

TEST(sync0, a_shot_that_was_armed_before_the_first_look_is_known)
{
	struct ring_bench b;
	struct master_item item;
	uint64_t at_ns = (uint64_t)(FAKE_DC0_NS + 50 * PERIOD_NS);

	begin(&b);
	fake_master_push(&b.fake, at_ns);
	fake_master_push(&b.fake, at_ns);
	CHECK_EQ(master_open(b.master), 1);
	watch_shots_of(&b, FAKE_SHOT_SLAVE);
	CHECK_EQ(next(&b, &item), 1);
	CHECK_EQ(item.shot[0].dc_ns, at_ns);
	CHECK_EQ(next(&b, &item), 0);
	end(&b);
}

TEST(sync0, shots_of_a_slave_that_is_not_in_one_shot_mode_are_not_looked_for)
{
	struct ring_bench b;
	struct master_item item;

	begin(&b);
	fake_master_push(&b.fake, (uint64_t)(FAKE_DC0_NS + 50 * PERIOD_NS));
	CHECK_EQ(master_open(b.master), 1);
	watch_shots_of(&b, 0);
	CHECK_EQ(next(&b, &item), 0);
	end(&b);
}
