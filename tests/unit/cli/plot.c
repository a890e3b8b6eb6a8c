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
		plot_add(plot, 0, i * NS_PER_MS + NS_PER_MS / 2, i);
	}
	CHECK_EQ(lines_of(plot, 13, lines), 13);
	CHECK_STR(lines[0], "first   now 39   min 0   max 39");
	CHECK(strncmp(lines[1], "        40|", 11) == 0);
	CHECK(strncmp(lines[10], "         0|", 11) == 0);
	CHECK_EQ(lines[1][11 + 39], '*');
	CHECK_EQ(lines[1][11], ' ');
	CHECK_EQ(lines[10][11], '*');
	CHECK_EQ(lines[10][11 + 39], ' ');
	CHECK(strstr(lines[12], "-20 ms") != NULL);
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

TEST(plot, ticks_are_round_and_where_their_values_are)
{
	struct plot *plot = make(1, PLOT_ASCII);

	for (int i = 0; i < 40; i++) {
		plot_add(plot, 0, i * NS_PER_MS + NS_PER_MS / 2, i % 2 == 0 ? 0.49963 : 1.4997);
	}
	CHECK_EQ(lines_of(plot, 13, lines), 13);
	CHECK(strncmp(lines[1], "       1.5|", 11) == 0);
	CHECK(strncmp(lines[10], "       0.0|", 11) == 0);
	for (int row = 1; row <= 10; row++) {
		char *end;
		double value = strtod(lines[row], &end);

		/* A label is a multiple of a half, or there is none. */
		CHECK(*end == '|' || end == lines[row]);
		CHECK(end == lines[row] || fabs(value * 2 - round(value * 2)) < 1e-9);
	}
	plot_destroy(plot);
}

TEST(plot, units_are_beside_the_values)
{
	static const char *const titles[] = { "volts" };
	static const char *const units[] = { "V" };
	struct plot_spec spec = {
		.panels = 1,
		.titles = titles,
		.units = units,
		.window_ns = 40 * NS_PER_MS,
		.columns = 52,
		.style = PLOT_ASCII,
	};
	struct plot *plot = plot_create(&spec);

	CHECK(plot != NULL);
	plot_add(plot, 0, 0, 1.25);
	lines_of(plot, 13, lines);
	CHECK_STR(lines[0], "volts   now 1.25 V   min 1.25   max 1.25");
	plot_destroy(plot);
}

TEST(plot, another_width_shows_the_same_values)
{
	struct plot *plot = make(1, PLOT_ASCII);

	for (int i = 0; i < 4000; i++) {
		plot_add(plot, 0, i * NS_PER_US * 10, i == 2005 ? 100 : 0);
	}
	plot_resize(plot, 92); /* 80 dots */
	CHECK_EQ(lines_of(plot, 13, lines), 13);
	CHECK_STR(lines[0], "first   now 0   min 0   max 100");
	CHECK_EQ(lines[1][11 + 40], '*');
	CHECK_EQ(lines[1][11 + 39], ' ');
	for (int row = 0; row < 13; row++) {
		CHECK(strlen(lines[row]) <= 92);
	}
	plot_resize(plot, 32); /* 20 dots */
	lines_of(plot, 13, lines);
	CHECK_EQ(lines[1][11 + 10], '*');
	plot_destroy(plot);
}

TEST(plot, cursors_give_both_values_and_the_distance)
{
	struct plot *plot = make(1, PLOT_ASCII);

	for (int i = 0; i < 40; i++) {
		plot_add(plot, 0, i * NS_PER_MS + NS_PER_MS / 2, i);
	}
	CHECK(!plot_cursors_are_on(plot));
	plot_cursors_toggle(plot);
	plot_cursors_move(plot, -1000); /* A: to the left edge */
	plot_cursors_switch(plot);
	plot_cursors_move(plot, 1000); /* B: to the right edge */
	lines_of(plot, 13, lines);
	CHECK_STR(lines[0], "first   A 0   B 39   dy 39");
	CHECK_EQ(lines[11][11], 'A');
	CHECK_EQ(lines[11][11 + 39], 'B');
	CHECK(llabs(plot_cursors_ns(plot) - 39 * NS_PER_MS) < NS_PER_MS / 10);
	plot_cursors_move(plot, -10);
	lines_of(plot, 13, lines);
	CHECK_STR(lines[0], "first   A 0   B 29   dy 29");
	CHECK(llabs(plot_cursors_ns(plot) - 29 * NS_PER_MS) < NS_PER_MS / 10);
	/* Their distance is a time: it is the same at any width. */
	plot_resize(plot, 92);
	CHECK(llabs(plot_cursors_ns(plot) - 29 * NS_PER_MS) < NS_PER_MS / 10);
	plot_destroy(plot);
}
