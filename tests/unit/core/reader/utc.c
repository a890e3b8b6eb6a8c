/* SPDX-License-Identifier: MIT */
#include "reader/utc.h"

#include <string.h>

#include "base/clock.h"
#include "harness/test.h"

#define YEAR_2026_NS (INT64_C(1767225600) * NS_PER_S)
#define BOOT_1970_NS (100 * NS_PER_S)
#define STEP_NS INT64_C(1000000)

struct bench {
	struct sample_meta meta;
	struct utc *utc;
	uint64_t cycle;
	int64_t utc_ns;
};

static void bench_open(struct bench *b, int32_t tai_offset_s)
{
	memset(b, 0, sizeof(*b));
	b->meta.period_ns = STEP_NS;
	b->meta.tai_offset_s = tai_offset_s;
	b->utc = utc_create(&b->meta);
	CHECK(b->utc != NULL);
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

		CHECK_EQ(utc_feed(b->utc, &h, &b->utc_ns), 0);
	}
}

static const char *quality(const struct bench *b)
{
	struct timemap_state state;

	CHECK(utc_changed(b->utc, &state) != UTC_UNCHANGED);
	CHECK(strlen(utc_explain(&state)) > 20);
	return utc_quality(&state);
}

TEST(utc, with_the_kernels_tai_offset_it_is_utc_and_marked_tai)
{
	struct bench b;

	bench_open(&b, 37);
	run(&b, YEAR_2026_NS + 37 * NS_PER_S, 2000);
	CHECK_STR(quality(&b), "tai");
	CHECK_EQ(b.utc_ns, YEAR_2026_NS + 1999 * STEP_NS);
	utc_destroy(b.utc);
}

TEST(utc, an_unset_tai_offset_is_reported_and_clock_tai_taken_for_utc)
{
	struct bench b;

	bench_open(&b, 0);
	run(&b, YEAR_2026_NS, 2000);
	CHECK_STR(quality(&b), "utc");
	CHECK_EQ(b.utc_ns, YEAR_2026_NS + 1999 * STEP_NS);
	utc_destroy(b.utc);
}

TEST(utc, an_unset_wall_clock_is_reported_and_its_first_setting_is_one_step)
{
	struct bench b;
	struct timemap_state state;

	bench_open(&b, 0);
	run(&b, BOOT_1970_NS, 3000);
	CHECK_STR(quality(&b), "unset");
	run(&b, YEAR_2026_NS, 5000); /* chrony has the time now */
	CHECK_EQ(utc_changed(b.utc, &state), UTC_STEPPED);
	CHECK_STR(utc_quality(&state), "utc");
	CHECK_EQ(state.steps, 1);
	CHECK_EQ(b.utc_ns, YEAR_2026_NS + 7999 * STEP_NS);
	utc_destroy(b.utc);
}

TEST(utc, a_tai_offset_that_comes_later_does_not_move_utc)
{
	struct bench b;
	int64_t before_ns;

	bench_open(&b, 0);
	run(&b, YEAR_2026_NS, 3000);
	CHECK_STR(quality(&b), "utc");
	before_ns = b.utc_ns;
	utc_note_tai_offset(b.utc, 37);
	run(&b, YEAR_2026_NS + 37 * NS_PER_S, 3000);
	CHECK_STR(quality(&b), "tai");
	CHECK_EQ(b.utc_ns, before_ns + 3000 * STEP_NS);
	utc_destroy(b.utc);
}

/* As run() without DC: the cycle number times the period is used instead. */
static void run_without_dc(struct bench *b, int64_t tai_start_ns, unsigned count)
{
	for (unsigned i = 0; i < count; i++, b->cycle++) {
		struct sample_header h = { .cycle = b->cycle,
					   .wake_tai_ns =
						   tai_start_ns + (int64_t)b->cycle * STEP_NS,
					   .round_trip_ns = -1 };

		CHECK_EQ(utc_feed(b->utc, &h, &b->utc_ns), 0);
	}
}

TEST(utc, without_dc_the_wake_gives_the_time)
{
	struct bench b;

	bench_open(&b, 37);
	run_without_dc(&b, YEAR_2026_NS + 37 * NS_PER_S, 2000);
	CHECK_STR(quality(&b), "tai");
	CHECK_EQ(b.utc_ns, YEAR_2026_NS + 1999 * STEP_NS);
	utc_destroy(b.utc);
}

TEST(utc, when_dc_comes_or_goes_the_newest_tai_offset_stays)
{
	struct bench b;
	struct timemap_state state;

	bench_open(&b, 0);
	run(&b, YEAR_2026_NS, 3000);
	utc_note_tai_offset(b.utc, 37);
	run(&b, YEAR_2026_NS + 37 * NS_PER_S, 3000);
	CHECK_STR(quality(&b), "tai");
	run_without_dc(&b, YEAR_2026_NS + 37 * NS_PER_S, 10);
	/* A map of its own, reported at once and not as a step. */
	CHECK_EQ(utc_changed(b.utc, &state), UTC_UPDATED);
	CHECK_EQ(state.tai_offset_s, 37);
	CHECK_EQ(b.utc_ns, YEAR_2026_NS + 6009 * STEP_NS);
	utc_destroy(b.utc);
}

TEST(utc, the_map_is_reported_once_a_second_and_a_step_at_once_and_once)
{
	struct bench b;
	struct timemap_state state;
	unsigned updated = 0;
	unsigned stepped = 0;

	bench_open(&b, 37);
	CHECK_EQ(utc_changed(b.utc, &state), UTC_UNCHANGED);
	for (unsigned i = 0; i < 10000; i++) {
		run(&b, YEAR_2026_NS, 1);
		updated += utc_changed(b.utc, &state) == UTC_UPDATED;
	}
	CHECK(updated >= 8 && updated <= 11);
	for (unsigned i = 0; i < 10000; i++) {
		enum utc_change change;

		run(&b, YEAR_2026_NS + 3600 * NS_PER_S, 1);
		change = utc_changed(b.utc, &state);
		stepped += change == UTC_STEPPED;
		if (change == UTC_STEPPED) {
			CHECK_EQ(state.steps, 1);
			CHECK_EQ(utc_changed(b.utc, &state), UTC_UNCHANGED);
		}
	}
	CHECK_EQ(stepped, 1);
	CHECK_EQ(utc_of_tai(b.utc, YEAR_2026_NS + 37 * NS_PER_S), YEAR_2026_NS);
	utc_destroy(b.utc);
}

TEST(utc, invalid_times_do_no_harm)
{
	static const int64_t times[] = { INT64_MIN, INT64_MIN + 1, INT64_MAX, -1, 0 };
	struct bench b;

	bench_open(&b, 37);
	for (size_t i = 0; i < sizeof(times) / sizeof(times[0]); i++) {
		for (size_t k = 0; k < sizeof(times) / sizeof(times[0]); k++) {
			struct sample_header h = { .cycle = (uint64_t)times[i],
						   .dc_time_ns = times[k],
						   .frame_dc_ns = times[i],
						   .wake_tai_ns = times[k],
						   .round_trip_ns = INT32_MAX,
						   .wake_latency_ns = INT32_MAX };

			CHECK_EQ(utc_feed(b.utc, &h, &b.utc_ns), 0);
		}
	}
	utc_destroy(b.utc);
}

TEST(utc, what_disciplines_the_hosts_clock_is_in_the_map)
{
	struct clock_quality quality = {
		.is_disciplined = 1, .error_ns = 12000000, .estimate_ns = 800000, .tai_offset_s = 37
	};
	struct timemap_state state;
	struct bench b;

	bench_open(&b, 37);
	run(&b, YEAR_2026_NS + 37 * NS_PER_S, 10);
	CHECK_EQ(utc_changed(b.utc, &state), UTC_UPDATED);
	CHECK_EQ(state.clock_error_ns, -1); /* nobody has said anything */
	CHECK_EQ(state.clock_estimate_ns, -1);
	utc_note_clock(b.utc, &quality);
	run(&b, YEAR_2026_NS + 37 * NS_PER_S, 1500);
	CHECK_EQ(utc_changed(b.utc, &state), UTC_UPDATED);
	CHECK_EQ(state.clock_error_ns, 12000000);
	CHECK_EQ(state.clock_estimate_ns, 800000);
	quality.is_disciplined = 0;
	utc_note_clock(b.utc, &quality);
	run(&b, YEAR_2026_NS + 37 * NS_PER_S, 1500);
	CHECK_EQ(utc_changed(b.utc, &state), UTC_UPDATED);
	CHECK_EQ(state.clock_error_ns, -1);
	CHECK_EQ(state.clock_estimate_ns, -1);
	utc_destroy(b.utc);
}
