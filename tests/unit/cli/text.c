/* SPDX-License-Identifier: MIT */
#include "cli/text.h"

#include "base/clock.h"
#include "cli/source.h"
#include "harness/test.h"
#include "wire/sdo_abort.h"

TEST(text, times_change_their_unit_with_their_size)
{
	char buf[TEXT_BYTES];

	CHECK_STR(text_ns(0, buf), "0 ns");
	CHECK_STR(text_ns(-999, buf), "-999 ns");
	CHECK_STR(text_ns(12345, buf), "12.35 us");
	CHECK_STR(text_ns(-1500000, buf), "-1.5 ms");
	CHECK_STR(text_ns(2 * NS_PER_S, buf), "2 s");
}

TEST(text, sizes_change_their_unit_with_their_size)
{
	char buf[TEXT_BYTES];

	CHECK_STR(text_bytes(1023, buf), "1023 B");
	CHECK_STR(text_bytes(1536, buf), "1.5 KiB");
	CHECK_STR(text_bytes(UINT64_MAX, buf), "16384.0 PiB");
}

TEST(text, times_of_day_are_utc)
{
	char buf[TEXT_BYTES];

	CHECK_STR(text_utc(DC_EPOCH_UNIX_S * NS_PER_S + 7 * NS_PER_MS, buf),
		  "2000-01-01T00:00:00.007Z");
	CHECK_STR(text_utc(-1, buf), "?");
	CHECK_STR(text_uptime(83 * NS_PER_S, buf), "0:01:23");
	CHECK_STR(text_uptime(2 * 86400 * NS_PER_S + 3 * NS_PER_S, buf), "2d 0:00:03");
	CHECK_STR(text_uptime(-5, buf), "0:00:00");
}

TEST(text, unscaled_values_are_exact_and_scaled_ones_physical)
{
	struct channel ch = { .type = CHANNEL_UINT, .bit_len = 64, .scale = 1 };
	char buf[TEXT_BYTES];

	CHECK_STR(text_value(&ch, UINT64_MAX, buf), "18446744073709551615");
	ch.bit_len = 16;
	ch.scale = 0.5;
	ch.offset = -1;
	CHECK_STR(text_value(&ch, 5, buf), "1.5");
}

TEST(text, what_a_slave_says_of_itself_cannot_command_the_terminal)
{
	char buf[16];

	CHECK_STR(text_plain("a\033[2J\xb5\n", buf, sizeof(buf)), "a?[2J??");
}

TEST(text, flags_of_a_sample_are_words)
{
	char buf[128];

	samples_flags_format(0, buf, sizeof(buf));
	CHECK_STR(buf, "");
	samples_flags_format(SAMPLE_LOST | SAMPLE_DC_UNLOCKED | SAMPLE_DOUBLED, buf, sizeof(buf));
	CHECK_STR(buf, "lost dc_unlocked doubled");
	samples_flags_format(UINT32_MAX, buf, 8);
	CHECK_STR(buf, "lost la");
	CHECK_STR(samples_flag_name(9), "unchecked");
	CHECK(samples_flag_name(10) == NULL);
}

TEST(text, abort_codes_have_words)
{
	CHECK_STR(sdo_abort_to_str(0x06020000), "object does not exist");
	CHECK_STR(sdo_abort_to_str(1), "unknown");
}
