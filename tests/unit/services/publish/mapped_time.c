/* SPDX-License-Identifier: MIT */
#include "publish/mapped_time.h"

#include <string.h>

#include "base/clock.h"
#include "harness/test.h"

#define YEAR_2026_NS (INT64_C(1767225600) * NS_PER_S)
#define BOOT_1970_NS (100 * NS_PER_S)
#define STEP_NS INT64_C(1000000)

struct bench {
	struct sample_meta meta;
	struct mapped_time *mt;
	uint64_t cycle;
	int64_t utc_ns;
};

static void bench_open(struct bench *b, int32_t tai_offset_s)
{
	memset(b, 0, sizeof(*b));
	b->meta.period_ns = STEP_NS;
	b->meta.tai_offset_s = tai_offset_s;
	b->mt = mapped_time_create(&b->meta);
	CHECK(b->mt != NULL);
}

/* @count cycles; CLOCK_TAI read @tai_start_ns in cycle 0. */
static void run(struct bench *b, int64_t tai_start_ns, unsigned count)
{
	for (unsigned i = 0; i < count; i++, b->cycle++) {
		int64_t at_ns = (int64_t)b->cycle * STEP_NS;
		struct sample_header h = { .cycle = b->cycle,
					   .dc_time_ns = INT64_C(5000000000) + at_ns,
					   .frame_dc_ns = INT64_C(5000000000) + at_ns + 500000,
					   .wake_tai_ns = tai_start_ns + at_ns + 450000,
					   .round_trip_ns = 100000 };

		CHECK_EQ(mapped_time_feed(b->mt, &h, &b->utc_ns), 0);
	}
}

static const char *quality(const struct bench *b)
{
	struct timemap_state state;

	CHECK(mapped_time_news(b->mt, &state));
	CHECK(strlen(mapped_time_explain(&state)) > 20);
	return mapped_time_quality(&state);
}

TEST(mapped_time, with_the_kernels_tai_offset_it_is_utc_and_says_tai)
{
	struct bench b;

	bench_open(&b, 37);
	run(&b, YEAR_2026_NS + 37 * NS_PER_S, 2000);
	CHECK_STR(quality(&b), "tai");
	CHECK_EQ(b.utc_ns, YEAR_2026_NS + 1999 * STEP_NS);
	mapped_time_destroy(b.mt);
}

TEST(mapped_time, an_unset_tai_offset_is_said_and_clock_tai_taken_for_utc)
{
	struct bench b;

	bench_open(&b, 0);
	run(&b, YEAR_2026_NS, 2000);
	CHECK_STR(quality(&b), "utc");
	CHECK_EQ(b.utc_ns, YEAR_2026_NS + 1999 * STEP_NS);
	mapped_time_destroy(b.mt);
}

TEST(mapped_time, a_wall_clock_that_was_never_set_is_said_and_its_setting_is_survived)
{
	struct bench b;
	struct timemap_state state;

	bench_open(&b, 0);
	run(&b, BOOT_1970_NS, 3000);
	CHECK_STR(quality(&b), "unset");
	run(&b, YEAR_2026_NS, 5000); /* chrony has the time now */
	CHECK(mapped_time_news(b.mt, &state));
	CHECK_STR(mapped_time_quality(&state), "utc");
	CHECK_EQ(state.steps, 1);
	CHECK_EQ(b.utc_ns, YEAR_2026_NS + 7999 * STEP_NS);
	mapped_time_destroy(b.mt);
}

TEST(mapped_time, a_tai_offset_that_comes_later_does_not_move_utc)
{
	struct bench b;
	int64_t before_ns;

	bench_open(&b, 0);
	run(&b, YEAR_2026_NS, 3000);
	CHECK_STR(quality(&b), "utc");
	before_ns = b.utc_ns;
	mapped_time_note_tai_offset(b.mt, 37);
	run(&b, YEAR_2026_NS + 37 * NS_PER_S, 3000);
	CHECK_STR(quality(&b), "tai");
	CHECK_EQ(b.utc_ns, before_ns + 3000 * STEP_NS);
	mapped_time_destroy(b.mt);
}
