/* SPDX-License-Identifier: MIT */
#include "segment/signal.h"

#include <errno.h>

#include "harness/test.h"

TEST(signal, a_sine_is_read_as_it_is_written)
{
	struct signal_spec s;

	CHECK_EQ(signal_parse("sine:50:0.25:1.5", &s), 0);
	CHECK(s.frequency_hz == 50 && s.amplitude_v == 0.25 && s.offset_v == 1.5);
	CHECK(s.phase_rad == 0);
	CHECK_EQ(signal_parse("sine:1:0.5:1:180", &s), 0);
	CHECK(s.phase_rad > 3.14159 && s.phase_rad < 3.1416);
}

TEST(signal, what_is_no_sine_leaves_the_signal_as_it_was)
{
	static const char *const wrong[] = { "",
					     "sine",
					     "sine:1",
					     "sine:1:2",
					     "sine:1:2:",
					     "sine:1:2:3:",
					     "sine:1:2:3:4:5",
					     "sine:-1:2:3",
					     "sine:nan:2:3",
					     "sine:1:inf:3",
					     "square:1:2:3",
					     "sine:1:2:3x" };
	struct signal_spec s = signal_default();

	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		CHECK_EQ(signal_parse(wrong[i], &s), -EINVAL);
		CHECK(s.frequency_hz == 1.0 && s.amplitude_v == 0.5);
	}
}
