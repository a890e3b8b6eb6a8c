/* SPDX-License-Identifier: MIT */
#include "base/histogram.h"

#include "base/clock.h"
#include "base/event.h"
#include "base/status.h"
#include "harness/test.h"

static struct histogram h;

TEST(histogram, percentiles_are_within_three_percent_and_never_above_the_maximum)
{
	histogram_clear(&h);
	for (int64_t v = 1; v <= 100000; v++) {
		histogram_add(&h, v);
	}
	for (uint32_t percent = 1; percent <= 100; percent++) {
		int64_t exact = (int64_t)percent * 1000;
		int64_t got = histogram_percentile(&h, percent * 10000);

		CHECK(got >= exact && got <= exact + exact * 4 / 100 + 1);
	}
	CHECK_EQ(histogram_percentile(&h, 1000000), 100000);
}

TEST(histogram, a_signed_error_counts_by_magnitude_and_keeps_its_extremes)
{
	histogram_clear(&h);
	CHECK_EQ(histogram_percentile(&h, 500000), 0);
	histogram_add(&h, -5000);
	histogram_add(&h, 20);
	CHECK_EQ(h.min_ns, -5000);
	CHECK_EQ(h.max_ns, 20);
	CHECK_EQ(histogram_max_magnitude(&h), 5000);
	CHECK_EQ(histogram_percentile(&h, 1000000), 5000);
	CHECK_EQ(histogram_percentile(&h, 500000), 20);
}

TEST(histogram, values_beyond_the_last_bucket_are_kept_in_it)
{
	histogram_clear(&h);
	histogram_add(&h, INT64_MAX / 2);
	CHECK_EQ(histogram_percentile(&h, 990000),
		 INT64_MAX / 2 < histogram_bucket_floor(HISTOGRAM_BUCKETS) - 1
			 ? INT64_MAX / 2
			 : histogram_bucket_floor(HISTOGRAM_BUCKETS) - 1);
	histogram_add(&h, 0);
	CHECK_EQ(histogram_percentile(&h, 500000), 0);
}

TEST(clock, folding_takes_the_shorter_way_round_for_every_error)
{
	for (int64_t e = -2000000; e <= 2000000; e += 7) {
		int64_t folded = fold_ns(e, 1000000);

		CHECK(folded >= -500000 && folded < 500000);
		CHECK_EQ(mod_floor(e - folded, 1000000), 0);
	}
}

TEST(event, every_event_has_a_name_and_a_text)
{
	for (uint16_t id = EVENT_NONE + 1; id < EVENT_COUNT; id++) {
		struct event ev = { .id = id, .slave_pos = 3, .value = 42, .arg = { 1, 2 } };
		char text[200];

		CHECK(event_name(id) != NULL);
		CHECK(event_format(&ev, text, sizeof(text)) > 4);
		CHECK(strncmp(text, "event ", 6) != 0);
		for (uint16_t other = 0; other < id; other++) {
			CHECK(strcmp(event_name(id), event_name(other)) != 0);
		}
	}
	CHECK_STR(event_name(60000), "unknown");
}

TEST(status, every_state_has_a_name)
{
	for (uint32_t s = BUS_DOWN; s <= BUS_FAILED; s++) {
		CHECK(strcmp(bus_state_to_str(s), "unknown") != 0);
	}
	CHECK_STR(bus_state_to_str(99), "unknown");
	CHECK_STR(dc_state_to_str(DC_LOCKED), "locked");
	CHECK_STR(record_state_to_str(RECORD_FAILED), "failed");
}

TEST(event, an_event_without_a_slave_names_none)
{
	for (uint16_t id = EVENT_NONE + 1; id < EVENT_COUNT; id++) {
		struct event ev = {
			.id = id, .slave_pos = EVENT_NO_SLAVE, .value = -1, .arg = { -34, 7 }
		};
		char text[200];

		event_format(&ev, text, sizeof(text));
		if (id == EVENT_COMMAND || id == EVENT_COMMAND_REFUSED) {
			CHECK(strstr(text, "65535") == NULL);
			CHECK(strstr(text, "slave") == NULL);
		}
	}
}

TEST(event, a_refusal_has_its_reason_as_text)
{
	struct event ev = {
		.id = EVENT_COMMAND_REFUSED, .slave_pos = 2, .value = 5, .arg = { -34, 7 }
	};
	char text[200];

	event_format(&ev, text, sizeof(text));
	CHECK_STR(
		text,
		"slave 2: command of user 7 for channel 5 refused: Numerical result out of range");
}
