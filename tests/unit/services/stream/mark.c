/* SPDX-License-Identifier: MIT */
#include "stream/mark.h"

#include "harness/test.h"

TEST(stream_mark, a_number_is_read_as_it_was_written)
{
	struct mark a = { .has = 0 };
	struct mark b = { .has = 0 };
	char text[MARK_TEXT_BYTES];

	mark_set(&a, MARK_SESSION, UINT64_MAX);
	mark_format(&a, MARK_SESSION, text);
	CHECK_STR(text, "18446744073709551615");
	mark_take(&b, MARK_SESSION, text);
	CHECK(mark_has(&b, MARK_SESSION));
	CHECK_EQ(b.value[MARK_SESSION], UINT64_MAX);
	CHECK(!mark_has(&b, MARK_NEXT_CYCLE));
}

TEST(stream_mark, what_is_no_number_leaves_the_field_unset)
{
	static const char *const bad[] = {
		"", "-1", " 1", "+1", "1 ", "0x1", "18446744073709551616", "1e3"
	};

	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		struct mark mark = { .has = 0 };

		mark_take(&mark, MARK_SESSION, bad[i]);
		CHECK(!mark_has(&mark, MARK_SESSION));
	}
}

TEST(stream_mark, a_block_has_a_session_and_cycles)
{
	struct mark mark = { .has = 0 };

	mark_set(&mark, MARK_SESSION, 1);
	mark_set(&mark, MARK_FIRST_CYCLE, 5);
	CHECK(!mark_is_block(&mark));
	mark_set(&mark, MARK_NEXT_CYCLE, 5);
	CHECK(!mark_is_block(&mark));
	mark_set(&mark, MARK_NEXT_CYCLE, 6);
	CHECK(mark_is_block(&mark));
}

TEST(stream_mark, an_event_is_new_behind_the_newest_and_after_a_restart)
{
	const int64_t second = 1000000000;
	struct mark mark = { .has = 0 };

	CHECK(mark_event_is_new(&mark, 0, 0, 0));
	mark_set(&mark, MARK_EVENT_NEXT, 10);
	mark_set(&mark, MARK_EVENT_MONO, 500);
	mark_set(&mark, MARK_EVENT_TIME, (uint64_t)(100 * second));
	CHECK(mark_event_is_new(&mark, 10, 400, 0));
	CHECK(!mark_event_is_new(&mark, 9, 500, 100 * second));
	/* Two programs map the same event a little differently. */
	CHECK(!mark_event_is_new(&mark, 9, 500, 100 * second + 1000));
	CHECK(mark_event_is_new(&mark, 0, 501, 100 * second));
	CHECK(mark_event_is_new(&mark, 0, 1, 102 * second));
}
