/* SPDX-License-Identifier: MIT */
#include "base/timemap.h"

#include "base/clock.h"
#include "base/prng.h"
#include "harness/test.h"

#define DC_START (INT64_C(820000000) * NS_PER_S)
#define TAI_START (INT64_C(1766000037) * NS_PER_S)

/* One millisecond after the other: DC runs @rate_ppm away from the host; each pair has its delay.
 */
struct feeder {
	struct timemap *map;
	struct prng prng;
	int64_t dc_ns;
	int64_t host_ns; /* true host time, before the pair's delay */
	double rate_ppm;
	int64_t jitter_ns;
	int64_t last_utc_ns;
	int back_steps;
};

static struct feeder feeder_make(int64_t tai_ns, int32_t tai_offset_s)
{
	struct feeder f = { .map = timemap_create(tai_offset_s),
			    .prng = { 7 },
			    .dc_ns = DC_START,
			    .host_ns = tai_ns,
			    .rate_ppm = 0,
			    .jitter_ns = 0,
			    .last_utc_ns = INT64_MIN,
			    .back_steps = 0 };

	CHECK(f.map != NULL);
	return f;
}

static enum timemap_news feed_ms(struct feeder *f, int count)
{
	enum timemap_news worst = TIMEMAP_QUIET;

	for (int i = 0; i < count; i++) {
		int64_t delay = f->jitter_ns == 0
					? 0
					: (int64_t)prng_below(&f->prng, (uint64_t)f->jitter_ns);
		enum timemap_news news;
		int64_t utc_ns;

		/* Now and then a wake is very late, as on a host without a real-time kernel. */
		if (f->jitter_ns > 0 && prng_below(&f->prng, 50) == 0) {
			delay += 5 * NS_PER_MS;
		}
		f->dc_ns += NS_PER_MS;
		f->host_ns += NS_PER_MS + (int64_t)(f->rate_ppm);
		news = timemap_feed(f->map, f->dc_ns, f->host_ns - delay, 10000);
		worst = news > worst ? news : worst;
		utc_ns = timemap_utc_ns(f->map, f->dc_ns);
		f->back_steps += utc_ns <= f->last_utc_ns;
		f->last_utc_ns = utc_ns;
	}
	return worst;
}

static int64_t error_ns(const struct feeder *f, int32_t offset_s)
{
	return timemap_utc_ns(f->map, f->dc_ns) - (f->host_ns - offset_s * NS_PER_S);
}

TEST(timemap, first_pair_is_the_map_and_the_tai_offset_is_taken_off)
{
	struct timemap *map = timemap_create(37);

	CHECK(!timemap_is_ready(map));
	CHECK_EQ(timemap_feed(map, DC_START, TAI_START, 20000), TIMEMAP_UPDATED);
	CHECK(timemap_is_ready(map));
	CHECK_EQ(timemap_utc_ns(map, DC_START), TAI_START - 37 * NS_PER_S);
	CHECK_EQ(timemap_utc_ns(map, DC_START + 5), TAI_START - 37 * NS_PER_S + 5);
	CHECK_EQ(timemap_utc_ns(map, DC_START - 5), TAI_START - 37 * NS_PER_S - 5);
	timemap_destroy(map);
	timemap_destroy(NULL);
}

TEST(timemap, rate_of_a_slave_100_ppm_off_is_found_in_ten_seconds)
{
	struct feeder f = feeder_make(TAI_START, 37);
	struct timemap_state state;

	f.rate_ppm = 100;
	CHECK(feed_ms(&f, 20000) == TIMEMAP_UPDATED);
	timemap_get(f.map, &state);
	CHECK(state.rate_ppb > 99000 && state.rate_ppb < 101000);
	CHECK(llabs(error_ns(&f, 37)) < 1000);
	CHECK_EQ(f.back_steps, 0);
	CHECK_EQ(state.steps, 0);
	CHECK_EQ(state.tai_offset_s, 37);
	timemap_destroy(f.map);
}

TEST(timemap, late_wakes_neither_distort_the_map_nor_make_it_step)
{
	struct feeder f = feeder_make(TAI_START, 0);
	struct timemap_state state;

	f.rate_ppm = -40;
	f.jitter_ns = 100000;
	feed_ms(&f, 60000);
	timemap_get(f.map, &state);
	CHECK_EQ(state.steps, 0);
	CHECK_EQ(f.back_steps, 0);
	/* The median delay of 50 us is not known to the map; its scatter around it is what is
	 * tested. */
	CHECK(llabs(error_ns(&f, 0) + 50000) < 15000);
	CHECK(state.rate_ppb > -45000 && state.rate_ppb < -35000);
	CHECK(state.uncertainty_ns >= 10000 && state.uncertainty_ns < 100000);
	timemap_destroy(f.map);
}

/* Below the limit of a step the map is slewed: at most 2 ms a second, on top of the clocks' rate.
 */
TEST(timemap, a_small_error_is_reduced_no_faster_than_the_slew_limit)
{
	for (int sign = -1; sign <= 1; sign += 2) {
		struct feeder f = feeder_make(TAI_START, 0);
		struct timemap_state state;

		feed_ms(&f, 12000);
		f.host_ns += sign * (TIMEMAP_STEP_LIMIT_NS * 9 / 10);
		for (int i = 0; i < 20; i++) {
			feed_ms(&f, 250);
			timemap_get(f.map, &state);
			CHECK(llabs(state.rate_ppb) <= 3000000);
		}
		CHECK_EQ(state.steps, 0);
		CHECK_EQ(f.back_steps, 0);
		timemap_destroy(f.map);
	}
}

static void step_is_marked(int64_t step_ns)
{
	struct feeder f = feeder_make(TAI_START, 0);
	struct timemap_state state;

	f.rate_ppm = 20;
	feed_ms(&f, 12000);
	f.host_ns += step_ns;
	CHECK_EQ(feed_ms(&f, 900), TIMEMAP_STEPPED);
	timemap_get(f.map, &state);
	CHECK_EQ(state.steps, 1);
	CHECK(llabs(state.step_ns - step_ns) < 100000);
	CHECK_EQ(f.back_steps, step_ns < 0 ? 1 : 0);
	CHECK(feed_ms(&f, 12000) == TIMEMAP_UPDATED);
	CHECK(llabs(error_ns(&f, 0)) < 1000);
	timemap_destroy(f.map);
}

TEST(timemap, a_clock_set_one_hour_forward_is_one_marked_step)
{
	step_is_marked(3600 * NS_PER_S);
}

TEST(timemap, a_clock_set_one_hour_back_is_one_marked_step)
{
	step_is_marked(-3600 * NS_PER_S);
}

TEST(timemap, a_host_that_starts_in_1970_steps_once_when_its_clock_is_set)
{
	struct feeder f = feeder_make(12 * NS_PER_S, 0);
	struct timemap_state state;

	feed_ms(&f, 5000);
	CHECK(timemap_utc_ns(f.map, f.dc_ns) < 20 * NS_PER_S);
	CHECK(timemap_utc_ns(f.map, f.dc_ns) > 0);
	f.host_ns = TAI_START;
	CHECK_EQ(feed_ms(&f, 1000), TIMEMAP_STEPPED);
	timemap_get(f.map, &state);
	CHECK_EQ(state.steps, 1);
	CHECK_EQ(f.back_steps, 0);
	timemap_destroy(f.map);
}

TEST(timemap, a_small_correction_is_slewed_and_never_runs_backwards)
{
	struct feeder f = feeder_make(TAI_START, 0);
	struct timemap_state state;

	feed_ms(&f, 12000);
	f.host_ns -= 4 * NS_PER_MS;
	feed_ms(&f, 40000);
	timemap_get(f.map, &state);
	CHECK_EQ(state.steps, 0);
	CHECK_EQ(f.back_steps, 0);
	CHECK(llabs(error_ns(&f, 0)) < 10000);
	timemap_destroy(f.map);
}

TEST(timemap, one_block_of_late_pairs_is_not_a_step)
{
	struct feeder f = feeder_make(TAI_START, 0);
	struct timemap_state state;

	feed_ms(&f, 5000);
	f.host_ns += 50 * NS_PER_MS; /* a single block, 250 ms, read late */
	feed_ms(&f, 200);
	f.host_ns -= 50 * NS_PER_MS;
	feed_ms(&f, 5000);
	timemap_get(f.map, &state);
	CHECK_EQ(state.steps, 0);
	CHECK(llabs(error_ns(&f, 0)) < 1000);
	timemap_destroy(f.map);
}

TEST(timemap, the_kernels_new_tai_offset_is_not_a_step_of_utc)
{
	struct feeder f = feeder_make(TAI_START - 37 * NS_PER_S, 0);
	struct timemap_state state;

	feed_ms(&f, 5000);
	timemap_note_tai_offset(f.map, 37);
	f.host_ns += 37 * NS_PER_S;
	feed_ms(&f, 3000);
	timemap_get(f.map, &state);
	CHECK_EQ(state.steps, 0);
	CHECK_EQ(state.tai_offset_s, 37);
	CHECK_EQ(f.back_steps, 0);
	CHECK(llabs(error_ns(&f, 37)) < 1000);
	timemap_destroy(f.map);
}

TEST(timemap, a_changed_dc_time_is_one_step_and_absurd_pairs_are_ignored)
{
	struct feeder f = feeder_make(TAI_START, 0);
	struct timemap_state state;

	feed_ms(&f, 3000);
	CHECK_EQ(timemap_feed(f.map, INT64_MAX, TAI_START, 0), TIMEMAP_QUIET);
	CHECK_EQ(timemap_feed(f.map, INT64_MIN, INT64_MIN, 0), TIMEMAP_QUIET);
	CHECK(timemap_utc_ns(f.map, INT64_MAX) > 0);
	f.dc_ns = 1000;
	feed_ms(&f, 3000);
	timemap_get(f.map, &state);
	CHECK_EQ(state.steps, 1);
	CHECK(llabs(error_ns(&f, 0)) < 1000);
	timemap_destroy(f.map);
}
