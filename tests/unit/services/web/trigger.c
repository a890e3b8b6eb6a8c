/* SPDX-License-Identifier: MIT */
#include "web/trigger.h"

#include <math.h>

#include "harness/test.h"

/* The cycle of the newest trigger in samples that are 1 cycle apart; -1: none. */
static int64_t newest(const struct trigger *trigger, const double *value, const uint32_t *flags,
		      size_t count)
{
	struct trigger_search search;

	trigger_begin(&search, trigger, 100);
	for (size_t i = 0; i < count; i++) {
		const struct sample_header header = { .cycle = 100 + i,
						      .flags = flags == NULL ? 0 : flags[i] };

		trigger_add(&search, &header, value[i]);
	}
	return search.is_found ? (int64_t)search.found_cycle : -1;
}

static int64_t newest_of(enum trigger_kind kind, double level, double level2)
{
	/* Cycles        100 101 102 103 104 105 106 107 108 109 */
	const double value[] = { 0, 2, 5, 8, 5, 2, NAN, 9, 2, 2 };
	const struct trigger trigger = { .kind = kind, .level = level, .level2 = level2 };

	return newest(&trigger, value, NULL, sizeof(value) / sizeof(value[0]));
}

TEST(trigger, each_kind_finds_the_newest_place)
{
	CHECK_EQ(newest_of(TRIGGER_RISING, 4, 0), 102); /* not 107, behind a gap */
	CHECK_EQ(newest_of(TRIGGER_FALLING, 4, 0), 108);
	CHECK_EQ(newest_of(TRIGGER_ABOVE, 5, 0), 107);
	CHECK_EQ(newest_of(TRIGGER_BELOW, 0, 0), 100);
	CHECK_EQ(newest_of(TRIGGER_ENTERS, 4, 6), 104);
	CHECK_EQ(newest_of(TRIGGER_ENTERS, 6, 4), 104);
	CHECK_EQ(newest_of(TRIGGER_LEAVES, 4, 6), 105);
	CHECK_EQ(newest_of(TRIGGER_LEAVES, 8.5, 9.5), 108);
	CHECK_EQ(newest_of(TRIGGER_BAD, 0, 0), 106);
	CHECK_EQ(newest_of(TRIGGER_LOST, 0, 0), -1);
	CHECK_EQ(newest_of(TRIGGER_RISING, 10, 0), -1);
}

TEST(trigger, the_first_lost_frame_and_the_first_bad_sample_of_a_row_count)
{
	const double value[] = { 1, 1, NAN, NAN, 1, 1 };
	const uint32_t flags[] = { 0, SAMPLE_LOST, SAMPLE_SKIPPED, SAMPLE_LOST, 0, SAMPLE_LATE };
	const struct trigger lost = { .kind = TRIGGER_LOST };
	const struct trigger bad = { .kind = TRIGGER_BAD };

	CHECK_EQ(newest(&lost, value, flags, 6), 101);
	CHECK_EQ(newest(&bad, value, flags, 6), 102);
}

TEST(trigger, an_event_is_found_at_its_cycle)
{
	static const uint64_t events[] = { 50, 102, 104, 300 };
	const double value[6] = { 0 };
	struct trigger trigger = { .kind = TRIGGER_EVENT, .events = events, .event_count = 4 };

	CHECK_EQ(newest(&trigger, value, NULL, 6), 104);
	trigger.event_count = 1;
	CHECK_EQ(newest(&trigger, value, NULL, 6), -1);
}

/* A burst of three edges, each 2 cycles after the one before. */
TEST(trigger, within_the_hold_off_there_is_no_other_trigger)
{
	const double value[] = { 0, 1, 0, 1, 0, 1, 0, 0, 0, 0, 1 };
	struct trigger trigger = { .kind = TRIGGER_RISING, .level = 1 };

	CHECK_EQ(newest(&trigger, value, NULL, 10), 105);
	trigger.hold = 6;
	CHECK_EQ(newest(&trigger, value, NULL, 10), 101);
	CHECK_EQ(newest(&trigger, value, NULL, 11), 110);
	/* From the last one on, which is still shown while there is no other. */
	trigger.last = 103;
	CHECK_EQ(newest(&trigger, value, NULL, 10), 103);
	CHECK_EQ(newest(&trigger, value, NULL, 11), 110);
	trigger.hold = 7;
	CHECK_EQ(newest(&trigger, value, NULL, 11), 103);
	trigger.last = 99; /* out of sight */
	CHECK_EQ(newest(&trigger, value, NULL, 8), 101);
}

TEST(trigger, without_samples_for_what_is_before_it_there_is_none)
{
	const double value[] = { 0, 1 };
	struct trigger trigger = { .kind = TRIGGER_RISING, .level = 1, .before = 101 };

	CHECK_EQ(newest(&trigger, value, NULL, 2), 101);
	trigger.before = 102;
	CHECK_EQ(newest(&trigger, value, NULL, 2), -1);
}
