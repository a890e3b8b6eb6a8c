/* SPDX-License-Identifier: MIT */
#include "web/history.h"

#include <errno.h>
#include <math.h>
#include <unistd.h>

#include "harness/made_ring.h"
#include "harness/test.h"

enum { SLOTS = 4096, COUNTER = 1, LED = 3 };

static struct history_picture picture;

static struct ring *ring;
static struct history *history;

static void open_both(const char *name)
{
	const struct made_meta meta = made_meta();
	const char *path = made_path(name);

	ring = made_ring(path, &meta, SLOTS);
	CHECK_EQ(history_create(path, &history), 0);
	CHECK(history_table(history) != NULL);
}

static void close_both(const char *name)
{
	history_destroy(history);
	ring_destroy(ring);
	unlink(made_path(name));
}

static struct history_request request_of(uint64_t cycles, uint32_t pixels)
{
	return (struct history_request){
		.cycles = cycles, .pixels = pixels, .count = 1, .channel = { COUNTER }
	};
}

TEST(history, a_picture_without_a_master_or_a_sample_has_a_reason)
{
	const struct history_request request = request_of(10, 10);
	struct history *alone = NULL;

	CHECK_EQ(history_create("/nonexistent/samples", &alone), 0);
	CHECK(history_table(alone) == NULL);
	CHECK_EQ(history_draw(alone, &request, &picture), -ENODATA);
	history_destroy(alone);
	open_both("history");
	CHECK_EQ(history_draw(history, &request, &picture), -ENODATA);
	close_both("history");
}

TEST(history, no_value_is_lost_in_a_column_of_many_samples)
{
	struct history_request request = request_of(1000, 10);
	uint64_t oldest;
	uint64_t newest;

	open_both("history");
	for (uint64_t cycle = 5000; cycle < 6000; cycle++) {
		made_push(ring, cycle, 0, 0);
	}
	CHECK_EQ(history_range(history, &oldest, &newest), 0);
	CHECK_EQ(oldest, 5000);
	CHECK_EQ(newest, 5999);
	CHECK_EQ(history_draw(history, &request, &picture), 0);
	CHECK_EQ(picture.first, 5000);
	CHECK_EQ(picture.pixels, 10);
	CHECK_EQ(picture.samples, 1000);
	for (uint32_t k = 0; k < 10; k++) {
		CHECK_EQ(picture.mark[k], 0);
		CHECK((double)picture.column[0][k].max - (double)picture.column[0][k].min == 99);
	}
	CHECK_EQ(picture.sum[0].count, 1000);
	CHECK(picture.sum[0].max - picture.sum[0].min == 999);
	CHECK(fabs(picture.sum[0].mean - (picture.sum[0].max + picture.sum[0].min) / 2) < 1e-9);
	close_both("history");
}

TEST(history, a_picture_of_few_cycles_has_a_column_for_each)
{
	struct history_request request = request_of(20, 100);

	open_both("history");
	for (uint64_t cycle = 0; cycle < 300; cycle++) {
		made_push(ring, cycle, 0, 0);
	}
	request.end = 200;
	CHECK_EQ(history_draw(history, &request, &picture), 0);
	CHECK_EQ(picture.first, 180);
	CHECK_EQ(picture.pixels, 20);
	for (uint32_t k = 1; k < 20; k++) {
		CHECK(picture.column[0][k].min == picture.column[0][k - 1].max + 1);
	}
	close_both("history");
}

TEST(history, a_missing_cycle_and_a_bad_sample_are_gaps_with_a_mark)
{
	struct history_request request = request_of(100, 100);

	open_both("history");
	for (uint64_t cycle = 0; cycle < 100; cycle++) {
		if (cycle < 30 || cycle >= 40) {
			made_push(ring, cycle, cycle == 60 ? 1 : 0, 0);
		}
	}
	CHECK_EQ(history_draw(history, &request, &picture), 0);
	for (uint32_t k = 0; k < 100; k++) {
		int is_missing = k >= 30 && k < 40;

		CHECK_EQ(picture.mark[k], is_missing ? HISTORY_MISSING : k == 60 ? HISTORY_BAD : 0);
		CHECK_EQ(isnan(picture.column[0][k].min) != 0, is_missing || k == 60);
		CHECK_EQ(isnan(picture.column[0][k].max) != 0, is_missing || k == 60);
	}
	CHECK_EQ(picture.sum[0].count, 89);
	close_both("history");
}

TEST(history, what_has_left_the_ring_is_not_in_the_picture)
{
	struct history_request request = request_of(6000, 60);

	open_both("history");
	for (uint64_t cycle = 0; cycle < 6000; cycle++) {
		made_push(ring, cycle, 0, 0);
	}
	CHECK_EQ(history_draw(history, &request, &picture), 0);
	CHECK_EQ(picture.samples <= SLOTS, 1);
	CHECK_EQ(isnan(picture.column[0][0].min) != 0, 1);
	CHECK_EQ(isnan(picture.column[0][59].min) != 0, 0);
	close_both("history");
}

/* The counter passes a level once: at a known place of the picture. */
TEST(history, the_trigger_is_at_its_place_in_the_picture)
{
	struct history_request request = request_of(100, 100);
	double level;

	open_both("history");
	for (uint64_t cycle = 0; cycle < 1000; cycle++) {
		made_push(ring, cycle, 0, 0);
	}
	request.end = 701;
	CHECK_EQ(history_draw(history, &request, &picture), 0);
	level = (double)picture.column[0][99].min; /* of cycle 700 */
	request.end = 0;
	request.trigger.kind = TRIGGER_RISING;
	request.trigger.channel = COUNTER;
	request.trigger.level = level;
	request.trigger.before = 25;
	CHECK_EQ(history_draw(history, &request, &picture), 0);
	CHECK_EQ(picture.has_trigger, 1);
	CHECK_EQ(picture.trigger, 700);
	CHECK_EQ(picture.first, 675);
	CHECK((double)picture.column[0][25].min == level);
	request.trigger.kind = TRIGGER_FALLING;
	CHECK_EQ(history_draw(history, &request, &picture), -EAGAIN);
	close_both("history");
}

TEST(history, a_level_passed_within_a_gap_is_no_trigger)
{
	struct history_request request = request_of(100, 100);

	open_both("history");
	for (uint64_t cycle = 0; cycle < 1000; cycle++) {
		if (cycle < 690 || cycle > 710) {
			made_push(ring, cycle, 0, 0);
		}
	}
	request.end = 690;
	CHECK_EQ(history_draw(history, &request, &picture), 0);
	request.trigger.level = (double)picture.column[0][99].min + 5;
	request.end = 0;
	request.trigger.kind = TRIGGER_RISING;
	request.trigger.channel = COUNTER;
	CHECK_EQ(history_draw(history, &request, &picture), -EAGAIN);
	close_both("history");
}

TEST(history, a_request_out_of_its_bounds_is_rejected)
{
	struct history_request request;

	open_both("history");
	made_push(ring, 1, 0, 0);
	request = request_of(0, 10);
	CHECK_EQ(history_draw(history, &request, &picture), -EINVAL);
	request = request_of(HISTORY_CYCLES + 1, 10);
	CHECK_EQ(history_draw(history, &request, &picture), -EINVAL);
	request = request_of(10, 0);
	CHECK_EQ(history_draw(history, &request, &picture), -EINVAL);
	request = request_of(10, HISTORY_PIXELS + 1);
	CHECK_EQ(history_draw(history, &request, &picture), -EINVAL);
	request = request_of(10, 10);
	request.channel[0] = MADE_CHANNELS;
	CHECK_EQ(history_draw(history, &request, &picture), -EINVAL);
	request = request_of(10, 10);
	request.count = HISTORY_CHANNELS + 1;
	CHECK_EQ(history_draw(history, &request, &picture), -EINVAL);
	request = request_of(10, 10);
	request.trigger.kind = TRIGGER_RISING;
	request.trigger.channel = MADE_CHANNELS;
	CHECK_EQ(history_draw(history, &request, &picture), -EINVAL);
	request.trigger.channel = 0;
	request.trigger.before = 11;
	CHECK_EQ(history_draw(history, &request, &picture), -EINVAL);
	close_both("history");
}

TEST(history, the_newest_values_are_those_of_the_newest_sample_or_no_numbers)
{
	double value[MADE_CHANNELS];
	uint64_t cycle = 0;

	open_both("history");
	CHECK_EQ(history_newest(history, value, &cycle), -ENODATA);
	made_push(ring, 7, 0, 0);
	made_push(ring, 8, 2, 0); /* slave 1 is bad */
	CHECK_EQ(history_newest(history, value, &cycle), 0);
	CHECK_EQ(cycle, 8);
	CHECK_EQ(isnan(value[COUNTER]) != 0, 0);
	CHECK_EQ(isnan(value[LED]) != 0, 1);
	close_both("history");
}
