/* SPDX-License-Identifier: MIT */
#include "reader/table.h"

#include <errno.h>
#include <string.h>

#include "harness/made_ring.h"
#include "harness/test.h"

TEST(channel_table, channels_are_grouped_by_slave_and_found_by_entry)
{
	struct made_meta m = made_meta();
	struct channel_table *t;

	CHECK_EQ(channel_table_create(&m, sizeof(m), &t), 0);
	memset(&m, 0xff, sizeof(m)); /* it is a copy */
	CHECK_EQ(t->meta.session, MADE_SESSION);
	CHECK_STR(t->slaves[1].device, "B");
	CHECK_EQ(t->count[0], 2);
	CHECK_EQ(t->count[1], 2);
	CHECK_STR(channel_table_at(t, 0, 0)->name, "a.adc");
	CHECK_STR(channel_table_at(t, 0, 1)->name, "a.counter");
	CHECK_STR(channel_table_at(t, 1, 0)->name, "b.led");
	CHECK_STR(channel_table_at(t, 1, 1)->name, "b.adc");
	CHECK_EQ(channel_table_find_entry(t, 1, "adc", CHANNEL_INPUT), 3);
	CHECK_EQ(channel_table_find_entry(t, 1, "adc", CHANNEL_OUTPUT), -ENOENT);
	CHECK_EQ(channel_table_find_entry(t, 1, "counter", CHANNEL_INPUT), -ENOENT);
	CHECK_EQ(channel_table_find_entry(t, 1, "led", CHANNEL_OUTPUT), 0);
	channel_table_destroy(t);
}

#define AT(field) offsetof(struct made_meta, field), sizeof(((struct made_meta *)0)->field)

enum { BEYOND_LIMITS = 5 }; /* the first of those below */

TEST(channel_table, a_meta_area_that_is_not_consistent_is_refused)
{
	static const struct {
		size_t offset;
		size_t bytes;
		uint64_t value; /* in each 8 bytes of the field */
	} wrong[] = {
		{ AT(head.slave_count), LIMIT_SLAVES + 1 },
		{ AT(head.slave_count), UINT32_MAX },
		{ AT(head.channel_count), LIMIT_CHANNELS + 1 },
		{ AT(head.channel_count), UINT32_MAX },
		{ AT(head.image_bytes), LIMIT_IMAGE_BYTES + 1 },
		{ AT(head.output_bytes), MADE_IMAGE_BYTES + 1 },
		{ AT(head.period_ns), 0 },
		{ AT(head.period_ns), 1000000000 },
		{ AT(head.tai_offset_s), INT32_MAX },
		{ AT(head.tai_offset_s), (uint32_t)INT32_MIN },
		{ AT(slave[1].slave_pos), 0 },
		{ AT(slave[1].name), UINT64_MAX },
		{ AT(slave[0].device), UINT64_MAX },
		{ AT(slave[0].counter_channel), MADE_CHANNELS },
		{ AT(channel[3].name), UINT64_MAX },
		{ AT(channel[3].unit), UINT64_MAX },
		{ AT(channel[2].bit_offset), MADE_IMAGE_BYTES * 8 - 15 },
		{ AT(channel[2].bit_offset), UINT32_MAX },
		{ AT(channel[2].bit_len), 65 },
		{ AT(channel[2].type), 9 },
		{ AT(channel[2].direction), 2 },
		{ AT(channel[2].slave_pos), MADE_SLAVES }, /* of no slave */
	};
	struct channel_table *t = NULL;
	struct made_meta m;

	for (size_t n = 0; n < sizeof(wrong) / sizeof(wrong[0]); n++) {
		m = made_meta();
		for (size_t i = 0; i < wrong[n].bytes; i += 8) {
			memcpy((char *)&m + wrong[n].offset + i, &wrong[n].value,
			       wrong[n].bytes - i < 8 ? wrong[n].bytes - i : 8);
		}
		if (channel_table_create(&m, sizeof(m), &t) !=
		    (n < BEYOND_LIMITS ? -E2BIG : -EPROTO)) {
			test_fail(__FILE__, __LINE__, "case %zu was accepted", n);
		}
	}
	m = made_meta();
	for (size_t bytes = 0; bytes < sizeof(m); bytes++) {
		CHECK_EQ(channel_table_create(&m, bytes, &t), -EPROTO);
	}
	CHECK(t == NULL);
}

TEST(sample_is_good, the_bit_of_the_slave_decides_and_no_flag)
{
	/* bus.datagrams: per_slave, slave 1 of three lost. */
	struct sample_header h = { .flags = SAMPLE_WKC_LOW, .slaves_bad = { { 2 } } };

	CHECK(sample_is_good(&h, 0));
	CHECK(!sample_is_good(&h, 1));
	CHECK(sample_is_good(&h, 2));
	CHECK_EQ(slave_set_count(sample_bad_slaves(&h)), 1);
	CHECK(slave_set_has(sample_bad_slaves(&h), 1));
	for (unsigned bit = 0; bit < 32; bit++) {
		h.flags = 1u << bit;
		CHECK(sample_is_good(&h, 0));
		CHECK(!sample_is_good(&h, 1));
	}
}

TEST(sample_is_good, the_last_slave_has_a_bit_and_one_past_it_is_never_good)
{
	struct sample_header h = { .cycle = 1 };

	slave_set_add(&h.slaves_bad, LIMIT_SLAVES - 1);
	CHECK(!sample_is_good(&h, LIMIT_SLAVES - 1));
	CHECK(sample_is_good(&h, LIMIT_SLAVES - 2));
	CHECK(!sample_is_good(&h, LIMIT_SLAVES));
	CHECK(!sample_is_good(&h, UINT16_MAX));
}
