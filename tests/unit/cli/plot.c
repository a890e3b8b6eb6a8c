/* SPDX-License-Identifier: MIT */
#include "cli/plot.h"

#include <math.h>

#include "base/clock.h"
#include "harness/test.h"

/* Label and border take 12 columns: 40 are left. */
static struct plot *make(unsigned panels, enum plot_style style)
{
	static const char *const titles[] = { "first", "second" };
	struct plot_spec spec = {
		.panels = panels,
		.titles = titles,
		.window_ns = 40 * NS_PER_MS,
		.columns = 52,
		.style = style,
	};
	struct plot *plot = plot_create(&spec);

	CHECK(plot != NULL);
	return plot;
}

/* The plot as lines; their number is returned. */
static int lines_of(const struct plot *plot, int rows, char lines[64][256])
{
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);
	int count = 0;

	CHECK(out != NULL);
	plot_write(plot, rows, out);
	CHECK_EQ(fclose(out), 0);
	for (char *p = text; *p != '\0' && count < 64; count++) {
		size_t line_len = strcspn(p, "\n");

		CHECK(line_len < 256 && p[line_len] == '\n');
		memcpy(lines[count], p, line_len);
		lines[count][line_len] = '\0';
		p += line_len + 1;
	}
	free(text);
	return count;
}

static char lines[64][256];

TEST(plot, without_values_says_so)
{
	struct plot *plot = make(1, PLOT_ASCII);

	CHECK_EQ(lines_of(plot, 13, lines), 13);
	CHECK_STR(lines[0], "first   no values yet");
	plot_destroy(plot);
	plot_destroy(NULL);
}

TEST(plot, ramp_goes_from_the_lower_left_to_the_upper_right)
{
	struct plot *plot = make(1, PLOT_ASCII);

	for (int i = 0; i < 40; i++) {
		plot_add(plot, 0, i * NS_PER_MS, i);
	}
	CHECK_EQ(lines_of(plot, 13, lines), 13);
	CHECK_STR(lines[0], "first   now 39   min 0   max 39");
	CHECK(strncmp(lines[1], "        39|", 11) == 0);
	CHECK(strncmp(lines[10], "         0|", 11) == 0);
	CHECK_EQ(lines[1][11 + 39], '*');
	CHECK_EQ(lines[1][11], ' ');
	CHECK_EQ(lines[10][11], '*');
	CHECK_EQ(lines[10][11 + 39], ' ');
	CHECK(strstr(lines[12], "-0.04 s") != NULL);
	CHECK(strstr(lines[12], "-0.02 s") != NULL);
	CHECK(strstr(lines[12], "now") != NULL);
	plot_destroy(plot);
}

TEST(plot, sine_shows_both_its_extremes)
{
	struct plot *plot = make(1, PLOT_BRAILLE);

	for (int i = 0; i < 400; i++) {
		plot_add(plot, 0, i * NS_PER_MS / 10, 1000 + 500 * sin(2 * M_PI * i / 200));
	}
	CHECK_EQ(lines_of(plot, 13, lines), 13);
	CHECK_STR(lines[0], "first   now 984.295   min 500   max 1500");
	CHECK(strstr(lines[1], "\xe2\xa0") != NULL || strstr(lines[1], "\xe2\xa1") != NULL ||
	      strstr(lines[1], "\xe2\xa2") != NULL || strstr(lines[1], "\xe2\xa3") != NULL);
	plot_destroy(plot);
}

TEST(plot, spike_of_one_sample_is_seen_in_its_column)
{
	struct plot *plot = make(1, PLOT_ASCII);

	for (int i = 0; i < 4000; i++) {
		plot_add(plot, 0, i * NS_PER_US * 10, i == 2005 ? 100 : 0);
	}
	CHECK_EQ(lines_of(plot, 13, lines), 13);
	CHECK_STR(lines[0], "first   now 0   min 0   max 100");
	for (int row = 1; row <= 10; row++) {
		CHECK_EQ(lines[row][11 + 20], '*');
	}
	plot_destroy(plot);
}

TEST(plot, old_values_leave_the_window)
{
	struct plot *plot = make(1, PLOT_ASCII);

	plot_add(plot, 0, 0, 1000);
	for (int i = 40; i < 80; i++) {
		plot_add(plot, 0, i * NS_PER_MS, 1);
	}
	lines_of(plot, 13, lines);
	CHECK_STR(lines[0], "first   now 1   min 1   max 1");
	plot_destroy(plot);
}

TEST(plot, gap_in_time_stays_empty)
{
	struct plot *plot = make(1, PLOT_ASCII);

	plot_add(plot, 0, 0, 1);
	plot_add(plot, 0, 39 * NS_PER_MS, 2);
	lines_of(plot, 13, lines);
	for (int row = 1; row <= 10; row++) {
		CHECK_EQ(lines[row][11 + 20], ' ');
	}
	plot_destroy(plot);
}

TEST(plot, time_that_goes_back_starts_anew)
{
	struct plot *plot = make(1, PLOT_ASCII);

	plot_add(plot, 0, NS_PER_S, 7);
	plot_add(plot, 0, 0, 3);
	lines_of(plot, 13, lines);
	CHECK_STR(lines[0], "first   now 3   min 3   max 3");
	plot_destroy(plot);
}

TEST(plot, values_that_are_no_numbers_are_left_out)
{
	struct plot *plot = make(1, PLOT_ASCII);

	plot_add(plot, 0, 0, (double)NAN);
	plot_add(plot, 0, 0, HUGE_VAL);
	lines_of(plot, 13, lines);
	CHECK_STR(lines[0], "first   no values yet");
	plot_destroy(plot);
}

TEST(plot, panels_share_the_rows)
{
	struct plot *plot = make(2, PLOT_ASCII);

	plot_add(plot, 0, 0, 1);
	plot_add(plot, 1, 0, 2);
	CHECK_EQ(lines_of(plot, 24, lines), 24);
	CHECK_STR(lines[0], "first   now 1   min 1   max 1");
	CHECK_STR(lines[11], "second   now 2   min 2   max 2");
	plot_destroy(plot);
}

TEST(plot, flat_curve_of_a_huge_value_runs_through_the_middle)
{
	struct plot *plot = make(1, PLOT_ASCII);

	for (int i = 0; i < 40; i++) {
		plot_add(plot, 0, i * NS_PER_MS, 8e17);
	}
	lines_of(plot, 14, lines);
	for (int row = 1; row <= 11; row++) {
		CHECK_EQ(lines[row][11 + 20], row == 6 ? '*' : ' ');
	}
	plot_destroy(plot);
}

TEST(plot, extreme_values_do_no_harm)
{
	struct plot *plot = make(1, PLOT_BRAILLE);

	plot_add(plot, 0, INT64_MAX - 1, 1.7e308);
	plot_add(plot, 0, INT64_MAX, -1.7e308);
	plot_add(plot, 0, -5, 1);
	CHECK(lines_of(plot, -3, lines) > 0);
	plot_destroy(plot);
}
