/* SPDX-License-Identifier: MIT */
#include "base/event.h"

#include "harness/test.h"

TEST(event, every_severity_has_a_word_of_its_own)
{
	CHECK_STR(event_severity_to_str(EVENT_INFO), "info");
	CHECK_STR(event_severity_to_str(EVENT_NOTICE), "notice");
	CHECK_STR(event_severity_to_str(EVENT_WARNING), "warning");
	CHECK_STR(event_severity_to_str(EVENT_ERROR), "error");
}

TEST(event, a_number_that_is_none_is_an_error)
{
	CHECK_EQ(event_severity(EVENT_COUNT), EVENT_ERROR);
	CHECK_STR(event_severity_to_str((enum event_severity)99), "error");
}
