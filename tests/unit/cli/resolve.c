/* SPDX-License-Identifier: MIT */
/* What of a command line of ecdaqd makes its configuration. */
#include "cli/resolve.h"

#include "harness/test.h"

static struct resolve_words words;

static void parse(const char *line)
{
	static char text[256];

	snprintf(text, sizeof(text), "%s", line);
	resolve_parse(text, strlen(text), ' ', &words);
}

TEST(doctor_resolve, options_are_taken_with_their_values_in_both_spellings)
{
	parse("/usr/bin/ecdaqd --wait --config /etc/e.yaml --set a=1 --set=b=2 --interface=ecat0");
	CHECK_STR(words.config, "/etc/e.yaml");
	CHECK_STR(words.interface, "ecat0");
	CHECK_EQ(words.set_count, 2);
	CHECK_STR(words.set[0], "a=1");
	CHECK_STR(words.set[1], "b=2");
}

TEST(doctor_resolve, other_options_and_missing_values_are_passed_over)
{
	parse("ecdaqd --configure x --settle y --set");
	CHECK(words.config == NULL);
	CHECK(words.interface == NULL);
	CHECK_EQ(words.set_count, 0);
	parse("");
	CHECK(words.config == NULL);
	parse("   ");
	CHECK_EQ(words.set_count, 0);
}

TEST(doctor_resolve, more_sets_than_ecdaqd_takes_are_not_taken_either)
{
	static char text[RESOLVE_TEXT_BYTES];
	size_t len = 0;

	for (int i = 0; i < RESOLVE_SETS + 10; i++) {
		len += (size_t)snprintf(text + len, sizeof(text) - len, "--set=a=%d ", i);
	}
	resolve_parse(text, len, ' ', &words);
	CHECK_EQ(words.set_count, RESOLVE_SETS);
	CHECK_STR(words.set[RESOLVE_SETS - 1], "a=255");
}
