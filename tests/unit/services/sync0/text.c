/* SPDX-License-Identifier: MIT */
#include "base/event.h"
#include "base/sync0.h"
#include "harness/test.h"

TEST(sync0, an_unresolved_figure_is_a_bound_and_never_nought)
{
	struct sync0_result r = { .verdict = SYNC0_UNRESOLVED,
				  .cycles = 1000,
				  .edges = 1000,
				  .skew_ns = 0,
				  .skew_error_ns = 4,
				  .jitter_p99_ns = 5180,
				  .jitter_max_ns = 12900,
				  .dc_diff_ns = 21,
				  .has = SYNC0_HAS_PERIOD | SYNC0_HAS_SKEW };
	char text[512];

	sync0_result_format(&r, text, sizeof(text));
	CHECK(strstr(text, "skew < 4 ns (unresolved)") != NULL);
	CHECK(strstr(text, "p99 < 5180 ns") != NULL);
	CHECK(strstr(text, "0x092C <= 21 ns") != NULL);
	r.is_resolved = SYNC0_HAS_SKEW | SYNC0_HAS_JITTER;
	r.skew_ns = 3000;
	sync0_result_format(&r, text, sizeof(text));
	CHECK(strstr(text, "skew +3000 ns +-4") != NULL);
	CHECK(strstr(text, "unresolved") == NULL);
	CHECK(sync0_result_format(&r, text, 8) > 8);
	CHECK_EQ(strlen(text), 7);
}

TEST(sync0, every_alarm_names_slave_and_line)
{
	char text[256];

	for (uint16_t id = EVENT_SYNC0_LOST; id <= EVENT_SYNC0_SHOT_LOST; id++) {
		struct event ev = { .id = id, .slave_pos = 3, .line = 2, .value = 4711 };

		event_format(&ev, text, sizeof(text));
		CHECK(strstr(text, "slave 3, line 2") != NULL);
		CHECK(strstr(text, "4711") != NULL);
		CHECK(strstr(text, "event ") == NULL);
		CHECK(strncmp(event_name(id), "sync0_", 6) == 0);
	}
}

TEST(sync0, numbers_out_of_range_have_a_word_too)
{
	CHECK_STR(sync0_verdict_to_str(77), "unknown");
	CHECK_STR(sync0_source_to_str(77), "unknown");
	CHECK_STR(sync0_check_to_str(77), "unknown");
	CHECK_STR(sync0_state_to_str(77), "unknown");
	CHECK_STR(sync0_verdict_to_str(SYNC0_UNRESOLVED), "UNRESOLVED");
}
