/* SPDX-License-Identifier: MIT */
/* Events with names and reasons, and those that repeat in one line. */
#include "program/event_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "harness/test.h"

static char text[EVENT_TEXT_BYTES];

static struct event at(enum event_id id, uint16_t slave, int64_t ms)
{
	return (struct event){ .id = (uint16_t)id,
			       .slave_pos = slave,
			       .cycle = (uint64_t)ms,
			       .mono_ns = ms * NS_PER_MS };
}

static struct status_page *page_with_rear(void)
{
	struct status_page *page = calloc(1, sizeof(*page));

	CHECK(page != NULL);
	page->slave_count = 2;
	snprintf(page->slave[1].info.name, sizeof(page->slave[1].info.name), "rear");
	return page;
}

TEST(event_text, a_slave_has_its_name_and_an_al_status_code_its_words)
{
	struct status_page *page = page_with_rear();
	struct event ev = at(EVENT_SLAVE_STATE, 1, 0);

	ev.arg[0] = 8;
	ev.arg[1] = 0x14;
	ev.value = 0x1b;
	event_text(&ev, page, text);
	CHECK_STR(text, "slave 1 rear: OP -> SAFE-OP+ERROR, AL status code 0x001b "
			"(SyncManager watchdog)");
	event_text(&ev, NULL, text);
	CHECK(strncmp(text, "slave 1: OP -> ", 15) == 0);
	ev = at(EVENT_SLAVE_LOST, 7, 0);
	event_text(&ev, page, text);
	CHECK_STR(text, "slave 7: lost");
	free(page);
}

TEST(event_text, lost_and_late_frames_are_one_line)
{
	struct event_fold fold = { .total = 0 };

	for (int i = 0; i < 6; i++) {
		struct event ev = at(i % 3 == 2 ? EVENT_FRAME_LATE : EVENT_FRAME_LOST,
				     EVENT_NO_SLAVE, i * 1000);

		CHECK(event_fold_add(&fold, &ev));
	}
	event_fold_text(&fold, NULL, text);
	CHECK_STR(text, "4 frames lost, 2 late in 5.0 s, cycle 0 to 5000");
	CHECK_EQ(event_fold_severity(&fold), EVENT_WARNING);
}

TEST(event_text, one_event_keeps_its_own_text)
{
	struct event_fold fold = { .total = 0 };
	struct event ev = at(EVENT_FRAME_LOST, EVENT_NO_SLAVE, 3);

	ev.value = 17;
	ev.arg[0] = 1;
	CHECK(event_fold_add(&fold, &ev));
	event_fold_text(&fold, NULL, text);
	CHECK_STR(text, "cycle 17: frame lost (1 in a row)");
}

TEST(event_text, what_is_no_repetition_or_comes_later_is_not_folded)
{
	struct event_fold fold = { .total = 0 };
	struct event first = at(EVENT_OVERRUN, EVENT_NO_SLAVE, 0);
	struct event in_time = at(EVENT_OVERRUN, EVENT_NO_SLAVE, 10000);
	struct event later = at(EVENT_OVERRUN, EVENT_NO_SLAVE, 10001);
	struct event other = at(EVENT_SLAVE_LOST, 1, 1);

	first.arg[0] = 3;
	CHECK(event_fold_add(&fold, &first));
	CHECK(!event_fold_add(&fold, &other));
	CHECK(event_fold_add(&fold, &in_time));
	CHECK(!event_fold_add(&fold, &later));
	event_fold_text(&fold, NULL, text);
	CHECK_STR(text, "2 overruns (3 cycles skipped) in 10.0 s, cycle 0 to 10000");
}

TEST(event_text, wrong_counters_name_the_slave_if_it_is_one)
{
	struct status_page *page = page_with_rear();
	struct event_fold fold = { .total = 0 };
	struct event ev = at(EVENT_COUNTER_BAD, 1, 0);

	CHECK(event_fold_add(&fold, &ev));
	CHECK(event_fold_add(&fold, &ev));
	event_fold_text(&fold, page, text);
	CHECK_STR(text, "2 wrong counters of slave 1 rear in 0.0 s, cycle 0 to 0");
	ev.slave_pos = 0;
	CHECK(event_fold_add(&fold, &ev));
	event_fold_text(&fold, page, text);
	CHECK_STR(text, "3 wrong counters in 0.0 s, cycle 0 to 0");
	free(page);
}
