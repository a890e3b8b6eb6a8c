/* SPDX-License-Identifier: MIT */
/* Lines, names and counts that fit a width. */
#include "cli/fit.h"

#include <stdlib.h>
#include <string.h>

#include "harness/test.h"

static void check_folded(const char *text, int columns, int indent, const char *expected)
{
	char *got = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&got, &len);

	CHECK(out != NULL);
	fit_write(text, columns, indent, out);
	CHECK_EQ(fclose(out), 0);
	CHECK_STR(got, expected);
	free(got);
}

TEST(fit, a_line_is_broken_between_fields_and_goes_on_below_its_first_one)
{
	check_folded("cycle      17   period 1 ms   WKC 6/6\n", 30, 11,
		     "cycle      17   period 1 ms\n           WKC 6/6\n");
	check_folded("short\n", 30, 11, "short\n");
	check_folded("", 30, 11, "");
}

TEST(fit, without_fields_it_is_broken_between_words_and_else_anywhere)
{
	check_folded("one two three four\n", 10, 2, "one two\n  three\n  four\n");
	check_folded("0123456789abcdef\n", 10, 2, "0123456789\n  abcdef\n");
}

TEST(fit, a_line_goes_on_behind_a_prefix)
{
	const char *text = "  # one two three";
	char *got = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&got, &len);

	CHECK(out != NULL);
	fit_write_line(text, strlen(text), 10, "  #   ", out);
	fit_write_line(text, strlen(text), 0, "  #   ", out);
	fit_write_line("ab c", 4, 2, "  ", out);
	CHECK_EQ(fclose(out), 0);
	CHECK_STR(got, "  # one\n  #   two\n  #   thre\n  #   e\n  # one two three\nab\n  c\n");
	free(got);
}

TEST(fit, text_is_collected_for_a_terminal_only)
{
	char *got = NULL;
	size_t len = 0;
	FILE *to = open_memstream(&got, &len);
	struct fit fit;

	CHECK(to != NULL);
	CHECK(fit_begin(&fit, 0, to) == to);
	fit_end(&fit, 2);
	fputs("one two three\n", fit_begin(&fit, 8, to));
	fit_end(&fit, 2);
	CHECK_EQ(fclose(to), 0);
	CHECK_STR(got, "one two\n  three\n");
	free(got);
}

TEST(fit, no_width_changes_nothing)
{
	check_folded("cycle      17   period 1 ms   WKC 6/6\n", 0, 11,
		     "cycle      17   period 1 ms   WKC 6/6\n");
}

TEST(fit, colours_and_bytes_of_one_character_take_no_column)
{
	const char *text = "\033[1;31mLOST\033[0m \xc2\xb5s";

	CHECK_EQ(fit_width(text), 7);
	CHECK_EQ(fit_cut(text, strlen(text), 7), strlen(text));
	CHECK_EQ(fit_cut(text, strlen(text), 6), strlen(text) - 1);
	CHECK_EQ(fit_cut(text, strlen(text), 2), strlen("\033[1;31mLO"));
	CHECK_EQ(fit_cut("\xc2\xb5\xc2\xb5", 4, 1), 2);
	/* A sequence that is no colour is text. */
	CHECK_EQ(fit_width("\033[2J"), 4);
}

TEST(fit, a_name_keeps_its_beginning_and_its_end)
{
	char buf[64];

	CHECK_STR(fit_name("rtd_inputs_channel_1_st_6000_03", 16, buf, sizeof(buf)),
		  "rtd_inpu~6000_03");
	CHECK_STR(fit_name("short", 5, buf, sizeof(buf)), "short");
	CHECK_STR(fit_name("longer", 1, buf, sizeof(buf)), "~");
	CHECK_STR(fit_name("longer", 2, buf, sizeof(buf)), "l~");
}

TEST(fit, a_count_keeps_three_digits)
{
	static const struct {
		uint64_t count;
		const char *text;
	} cases[] = { { 99999, "99999" },     { 100000, "100k" },     { 1234567, "1.23M" },
		      { 12345678, "12.3M" },  { 999949999, "1.00G" }, { 9995000, "10.0M" },
		      { UINT64_MAX, "18.4E" } };
	char buf[32];

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		CHECK_STR(fit_count(cases[i].count, 5, buf, sizeof(buf)), cases[i].text);
		CHECK(strlen(buf) <= 5);
	}
	CHECK_STR(fit_count(1234567, 10, buf, sizeof(buf)), "1234567");
}

TEST(fit, a_small_count_is_whole_however_narrow_the_column_is)
{
	char buf[16];

	CHECK_STR(fit_count(50, 1, buf, sizeof(buf)), "50");
	CHECK_STR(fit_count(999, 0, buf, sizeof(buf)), "999");
	CHECK_STR(fit_count(1000, 3, buf, sizeof(buf)), "1.00k");
}
