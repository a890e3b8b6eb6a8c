/* SPDX-License-Identifier: MIT */
#include "record/envelope.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/slave_set.h"
#include "harness/test.h"
#include "reader/table.h"

enum { CHANNELS = 4, IMAGE_BYTES = 16, LEVEL = 0, COUNT = 1, REAL = 2, ON = 3 };

/* One slave: an integer of 12 bits with a sign whose scale is negative, 64 bits without a sign, a
 * float, and a bit. */
struct world {
	struct channel_table *table;
	struct layout *layout;
	struct envelope *envelope;
	uint8_t image[IMAGE_BYTES];
	struct sample_header header;
};

static void start(struct world *w, uint64_t period_ns)
{
	static const struct {
		struct sample_meta head;
		struct slave_info slave;
		struct channel channel[CHANNELS];
	} meta = {
		.head = { .version = SAMPLE_VERSION,
			  .slave_count = 1,
			  .channel_count = CHANNELS,
			  .image_bytes = IMAGE_BYTES,
			  .session = 5 },
		.slave = { .name = "s" },
		.channel = { { .name = "s.level",
			       .type = CHANNEL_INT,
			       .bit_len = 12,
			       .scale = -0.5,
			       .offset = 3 },
			     { .name = "s.count",
			       .type = CHANNEL_UINT,
			       .bit_len = 64,
			       .bit_offset = 16,
			       .scale = 1 },
			     { .name = "s.real",
			       .type = CHANNEL_FLOAT,
			       .bit_len = 32,
			       .bit_offset = 80,
			       .scale = 2 },
			     { .name = "s.on",
			       .type = CHANNEL_BOOL,
			       .bit_len = 1,
			       .bit_offset = 115,
			       .scale = 1 } },
	};
	uint8_t bytes[sizeof(meta)];

	memset(w, 0, sizeof(*w));
	memcpy(bytes, &meta, sizeof(bytes));
	((struct sample_meta *)(void *)bytes)->period_ns = period_ns;
	CHECK_EQ(channel_table_create(bytes, sizeof(bytes), &w->table), 0);
	CHECK_EQ(layout_create(w->table, CONFIG_RECORD_BOTH, &w->layout), 0);
	CHECK_EQ(envelope_create(w->layout, &w->envelope), 0);
}

static void end(struct world *w)
{
	envelope_destroy(w->envelope);
	layout_destroy(w->layout);
	channel_table_destroy(w->table);
}

static void add(struct world *w, uint64_t cycle, int level, uint64_t count, float real)
{
	uint32_t bits;

	w->header.cycle = cycle;
	put_le16(w->image, (uint16_t)((unsigned)level & 0xFFFu));
	put_le64(w->image + 2, count);
	memcpy(&bits, &real, sizeof(bits));
	put_le32(w->image + 10, bits);
	w->image[14] = cycle % 2 ? 1u << 3 : 0;
	envelope_add(w->envelope, &w->header, w->image);
}

static struct envelope_view view(struct world *w)
{
	struct envelope_view v;

	CHECK_EQ(envelope_parse(envelope_bytes(w->envelope), envelope_size(w->envelope), &v), 0);
	CHECK_EQ(v.channels, CHANNELS);
	return v;
}

static int is_near(double value, double wanted)
{
	return fabs(value - wanted) <= fabs(wanted) * 1e-6;
}

static void check(struct envelope_sum s, uint64_t good, double min, double max, double mean,
		  double rms)
{
	CHECK_EQ(s.good, good);
	CHECK(is_near(s.min, min));
	CHECK(is_near(s.max, max));
	CHECK(is_near(s.sum / (double)s.good, mean));
	CHECK(is_near(sqrt(s.squares / (double)s.good), rms));
}

TEST(envelope, each_type_is_counted_in_its_physical_values)
{
	struct envelope_view v;
	struct world w;
	uint32_t samples;

	start(&w, 1000000);
	add(&w, 2000, -2048, UINT64_MAX, 1.5F);
	add(&w, 2001, 2047, UINT64_C(1) << 63, -2);
	v = view(&w);
	CHECK_EQ(v.blocks, 1);
	CHECK_EQ(v.block_cycles, 1000);
	CHECK_EQ(envelope_block(&v, 0, &samples), 2000);
	CHECK_EQ(samples, 2);
	check(envelope_get(&v, 0, LEVEL), 2, -1020.5, 1027, 3.25,
	      sqrt((1027.0 * 1027 + 1020.5 * 1020.5) / 2));
	check(envelope_get(&v, 0, COUNT), 2, 9223372036854775808.0, 18446744073709551615.0,
	      13835058055282163711.0, 9223372036854775808.0 * sqrt(2.5));
	check(envelope_get(&v, 0, REAL), 2, -4, 3, -0.5, sqrt(12.5));
	check(envelope_get(&v, 0, ON), 2, 0, 1, 0.5, sqrt(0.5));
	CHECK(mcap_text_is(envelope_channel(&v, ON), "s.on"));
	end(&w);
}

TEST(envelope, a_value_that_is_no_number_and_a_sample_that_is_not_good_are_not_counted)
{
	struct envelope_view v;
	struct world w;
	uint32_t samples;

	start(&w, 1000000);
	add(&w, 0, 1, 1, NAN);
	slave_set_add(&w.header.slaves_bad, 0);
	add(&w, 1, 2, 2, 2);
	v = view(&w);
	CHECK_EQ(envelope_block(&v, 0, &samples), 0);
	CHECK_EQ(samples, 2);
	check(envelope_get(&v, 0, LEVEL), 1, 2.5, 2.5, 2.5, 2.5);
	CHECK_EQ(envelope_get(&v, 0, REAL).good, 0);
	end(&w);
}

TEST(envelope, seconds_without_a_sample_are_left_out)
{
	struct envelope_view v;
	struct world w;
	uint32_t samples;

	start(&w, 1000000);
	CHECK_EQ(envelope_size(w.envelope), 0);
	add(&w, 999, 0, 0, 0);
	add(&w, 7000, 0, 0, 0);
	v = view(&w);
	CHECK_EQ(v.blocks, 2);
	CHECK_EQ(envelope_block(&v, 0, &samples), 0);
	CHECK_EQ(envelope_block(&v, 1, &samples), 7000);
	end(&w);
}

TEST(envelope, a_second_is_as_many_cycles_as_the_period_has_in_it)
{
	CHECK_EQ(envelope_block_cycles(1000000), 1000);
	CHECK_EQ(envelope_block_cycles(62500), 16000);
	CHECK_EQ(envelope_block_cycles(300000000), 3);
	CHECK_EQ(envelope_block_cycles(1000000000), 1);
	CHECK_EQ(envelope_block_cycles(5000000000), 1);
	CHECK_EQ(envelope_block_cycles(0), 1);
}

TEST(envelope, what_was_written_is_not_written_again)
{
	struct envelope_view v;
	struct world w;
	uint32_t samples;
	uint64_t cycle = 0;

	start(&w, 250000000);
	while (!envelope_is_full(w.envelope)) {
		add(&w, cycle++, 0, 0, 0);
	}
	CHECK_EQ(cycle, 4 * ENVELOPE_BLOCKS + 1);
	v = view(&w);
	CHECK_EQ(v.blocks, ENVELOPE_BLOCKS + 1);
	CHECK_EQ(envelope_block(&v, ENVELOPE_BLOCKS, &samples), 4 * ENVELOPE_BLOCKS);
	CHECK_EQ(samples, 1);
	envelope_clear(w.envelope);
	CHECK_EQ(envelope_size(w.envelope), 0);
	add(&w, cycle, 0, 0, 0);
	v = view(&w);
	CHECK_EQ(v.blocks, 1);
	CHECK_EQ(envelope_block(&v, 0, &samples), 4 * ENVELOPE_BLOCKS);
	CHECK_EQ(samples, 1);
	end(&w);
}

TEST(envelope, bytes_of_another_length_or_version_are_refused)
{
	struct envelope_view v;
	struct world w;
	size_t size;
	uint8_t *copy;

	start(&w, 1000000);
	add(&w, 0, 0, 0, 0);
	size = envelope_size(w.envelope);
	copy = malloc(size + 1);
	CHECK(copy != NULL);
	memcpy(copy, envelope_bytes(w.envelope), size);
	CHECK_EQ(envelope_parse(copy, size, &v), 0);
	for (size_t len = 0; len <= size + 1; len++) {
		CHECK(len == size || envelope_parse(copy, len, &v) == -EBADMSG);
	}
	copy[4] = copy[5] = 0; /* no cycles in a block */
	CHECK_EQ(envelope_parse(copy, size, &v), -EBADMSG);
	copy[0]++;
	CHECK_EQ(envelope_parse(copy, size, &v), -ENOTSUP);
	free(copy);
	end(&w);
}
