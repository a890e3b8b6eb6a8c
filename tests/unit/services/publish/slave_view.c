/* SPDX-License-Identifier: MIT */
#include "publish/slave_view.h"

#include <errno.h>

#include "harness/test.h"

struct area {
	struct sample_meta meta;
	struct slave_info slave[2];
	struct channel channel[3];
};

static struct area good_area(void)
{
	return (struct area){
		.meta = { .version = SAMPLE_VERSION,
			  .slave_count = 2,
			  .channel_count = 3,
			  .image_bytes = 8,
			  .period_ns = 1 },
		.slave = { { .slave_pos = 0 }, { .slave_pos = 1 } },
		.channel = { { .name = "b.counter",
			       .slave_pos = 1,
			       .type = CHANNEL_UINT,
			       .bit_len = 16 },
			     { .name = "a.adc", .type = CHANNEL_UINT, .bit_len = 16 },
			     { .name = "b.adc",
			       .slave_pos = 1,
			       .type = CHANNEL_UINT,
			       .bit_len = 16 } },
	};
}

TEST(publish_slave_view, channels_are_sorted_by_slave_and_known_names_found)
{
	struct area area = good_area();
	static struct slave_table t;

	CHECK_EQ(slave_table_read(&t, &area, sizeof(area)), 0);
	CHECK_EQ(t.view[0].count, 1);
	CHECK_EQ(t.view[1].count, 2);
	CHECK_EQ(t.order[t.view[0].first], 1);
	CHECK_EQ(t.order[t.view[1].first], 0);
	CHECK_EQ(t.view[0].adc, 1);
	CHECK_EQ(t.view[0].counter, -1);
	CHECK_EQ(t.view[1].adc, 2);
	CHECK_EQ(t.view[1].counter, 0);
}

TEST(publish_slave_view, meta_that_does_not_hold_together_is_refused)
{
	struct area area = good_area();
	static struct slave_table t;

	CHECK_EQ(slave_table_read(&t, &area, sizeof(area) - 1), -EPROTO);
	area.meta.version++;
	CHECK_EQ(slave_table_read(&t, &area, sizeof(area)), -EPROTO);
	area = good_area();
	area.meta.slave_count = LIMIT_SLAVES + 1;
	CHECK_EQ(slave_table_read(&t, &area, sizeof(area)), -EPROTO);
	area = good_area();
	area.channel[2].bit_offset = 60;
	CHECK_EQ(slave_table_read(&t, &area, sizeof(area)), -EPROTO);
	area = good_area();
	area.slave[1].slave_pos = 0;
	CHECK_EQ(slave_table_read(&t, &area, sizeof(area)), -EPROTO);
}

TEST(publish_slave_view, sample_is_good_only_when_fresh_and_counted_right)
{
	struct area area = good_area();
	static struct slave_table t;
	struct sample_header h = { .flags = SAMPLE_LATE };

	CHECK_EQ(slave_table_read(&t, &area, sizeof(area)), 0);
	CHECK(slave_is_good(&h, &t.view[0]));
	h.slaves_bad = 2;
	CHECK(slave_is_good(&h, &t.view[0]));
	CHECK(!slave_is_good(&h, &t.view[1]));
	h.flags = SAMPLE_LOST;
	CHECK(!slave_is_good(&h, &t.view[0]));
}
