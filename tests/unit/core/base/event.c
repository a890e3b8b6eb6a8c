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

TEST(event, an_unknown_event_number_is_an_error)
{
	CHECK_EQ(event_severity(EVENT_COUNT), EVENT_ERROR);
	CHECK_STR(event_severity_to_str((enum event_severity)99), "error");
}

TEST(event, a_shot_has_its_distance_or_a_bound_if_unresolved)
{
	struct event ev = { .id = EVENT_SYNC0_SHOT,
			    .slave_pos = 3,
			    .line = 2,
			    .value = 845,
			    .arg = { -7000, 50 } };
	char text[128];

	event_format(&ev, text, sizeof(text));
	CHECK_STR(text,
		  "slave 3, line 2: one-shot for DC time 845 came 7000 ns before it, +-50 ns");
	ev.arg[0] = 51;
	event_format(&ev, text, sizeof(text));
	CHECK_STR(text, "slave 3, line 2: one-shot for DC time 845 came 51 ns after it, +-50 ns");
	ev.arg[0] = 0;
	event_format(&ev, text, sizeof(text));
	CHECK_STR(text, "slave 3, line 2: one-shot for DC time 845 came; distance below 50 ns "
			"(unresolved)");
}

TEST(event, losses_of_eoe_name_the_slave_if_one_sent_what_was_rejected)
{
	struct event ev = { .id = EVENT_EOE_LOST, .slave_pos = 4, .arg = { 3, 2 } };
	char text[128];

	event_format(&ev, text, sizeof(text));
	CHECK_STR(text,
		  "EoE: 3 frames lost, 2 fragments or frames rejected, the newest of slave 4");
	ev.slave_pos = EVENT_NO_SLAVE;
	ev.arg[1] = 0;
	event_format(&ev, text, sizeof(text));
	CHECK_STR(text, "EoE: 3 frames lost, 0 fragments or frames rejected");
}
