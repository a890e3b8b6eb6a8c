/* SPDX-License-Identifier: MIT */
#include "cli/lines.h"

#include "harness/test.h"

/* bus.datagrams: per_slave with slave 1 lost: the flag is that of the cycle, not of each slave. */
TEST(lines, a_low_working_counter_marks_the_lost_slaves_channels_only)
{
	struct sample_header header = { .flags = SAMPLE_WKC_LOW, .slaves_bad = { { 2 } } };
	struct channel ch = { .slave_pos = 0 };

	CHECK(!lines_is_bad(&header, &ch));
	ch.slave_pos = 1;
	CHECK(lines_is_bad(&header, &ch));
	ch.slave_pos = 2;
	CHECK(!lines_is_bad(&header, &ch));
	header = (struct sample_header){ .flags = SAMPLE_LOST,
					 .slaves_bad = slave_set_all(LIMIT_SLAVES) };
	CHECK(lines_is_bad(&header, &ch));
}
