/* SPDX-License-Identifier: MIT */
#include "cli/plot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LABEL_COLUMNS = 11, COLUMNS_MIN = 20, PANEL_ROWS_MIN = 4, DOTS_LIMIT = 2048 };

/* All values of one dot column. */
struct bin {
	int64_t number; /* which column since the start of time; -1: none yet */
	double min;
	double max;
	double first;
	double last;
};

struct plot {
	struct plot_spec spec;
	int cells;          /* characters across */
	int dots;           /* dot columns across */
	int64_t bin_ns;     /* time of one dot column */
	int64_t newest_bin; /* -1: none yet */
	struct bin *bins;   /* panels * dots, each panel a ring by number */
};

static int dots_x(const struct plot *plot)
{
	return plot->spec.style == PLOT_BRAILLE ? 2 : 1;
}

static int dots_y(const struct plot *plot)
{
	return plot->spec.style == PLOT_BRAILLE ? 4 : 1;
}

static void forget(struct plot *plot)
{
	plot->newest_bin = -1;
	for (size_t i = 0; i < (size_t)plot->dots * plot->spec.panels; i++) {
		plot->bins[i].number = -1;
	}
}

struct plot *plot_create(const struct plot_spec *spec)
{
	struct plot *plot = calloc(1, sizeof(*plot));
	int columns = spec->columns < COLUMNS_MIN ? COLUMNS_MIN : spec->columns;

	if (plot == NULL) {
		return NULL;
	}
	plot->spec = *spec;
	plot->cells = columns - LABEL_COLUMNS - 1;
	if (plot->cells * dots_x(plot) > DOTS_LIMIT) {
		plot->cells = DOTS_LIMIT / dots_x(plot);
	}
	plot->dots = plot->cells * dots_x(plot);
	plot->bin_ns = spec->window_ns / plot->dots;
	if (plot->bin_ns < 1) {
		plot->bin_ns = 1;
	}
	plot->bins = calloc((size_t)plot->dots * spec->panels, sizeof(*plot->bins));
	if (plot->bins == NULL) {
		free(plot);
		return NULL;
	}
	forget(plot);
	return plot;
}

void plot_destroy(struct plot *plot)
{
	if (plot != NULL) {
		free(plot->bins);
		free(plot);
	}
}

static struct bin *bin_at(const struct plot *plot, unsigned panel, int64_t number)
{
	return &plot->bins[(size_t)panel * (size_t)plot->dots + (size_t)(number % plot->dots)];
}

void plot_add(struct plot *plot, unsigned panel, int64_t time_ns, double value)
{
	int64_t number = time_ns < 0 ? 0 : time_ns / plot->bin_ns;
	struct bin *bin;

	if (!isfinite(value)) {
		return;
	}
	if (number < plot->newest_bin) {
		forget(plot);
	}
	plot->newest_bin = number;
	bin = bin_at(plot, panel, number);
	if (bin->number != number) {
		*bin = (struct bin){
			.number = number, .min = value, .max = value, .first = value, .last = value
		};
		return;
	}
	bin->min = value < bin->min ? value : bin->min;
	bin->max = value > bin->max ? value : bin->max;
	bin->last = value;
}

/* The bin of dot column @x if it holds values of the window. */
static const struct bin *visible(const struct plot *plot, unsigned panel, int x)
{
	int64_t number = plot->newest_bin - (plot->dots - 1 - x);
	const struct bin *bin;

	if (plot->newest_bin < 0 || number < 0) {
		return NULL;
	}
	bin = bin_at(plot, panel, number);
	return bin->number == number ? bin : NULL;
}

struct span {
	double min;
	double max;
	double last;
	int is_empty;
};

static struct span span_of(const struct plot *plot, unsigned panel)
{
	struct span span = { .is_empty = 1 };

	for (int x = 0; x < plot->dots; x++) {
		const struct bin *bin = visible(plot, panel, x);

		if (bin == NULL) {
			continue;
		}
		if (span.is_empty || bin->min < span.min) {
			span.min = bin->min;
		}
		if (span.is_empty || bin->max > span.max) {
			span.max = bin->max;
		}
		span.last = bin->last;
		span.is_empty = 0;
	}
	return span;
}

/* One panel while it is drawn. */
struct view {
	const struct plot *plot;
	unsigned panel;
	struct span axis;
	int height; /* in dot rows */
};

/* Dot row of @value, 0 on top. */
static int row_of(const struct view *view, double value)
{
	const struct span *axis = &view->axis;

	/* Halves: the span of the largest numbers is more than a double holds. */
	double share = (axis->max / 2 - value / 2) / (axis->max / 2 - axis->min / 2);
	int row = (int)lround(share * (view->height - 1));

	if (row < 0) {
		return 0;
	}
	return row >= view->height ? view->height - 1 : row;
}

/*
 * The dot rows that column @x covers: its own span, stretched so that the curve has no hole between
 * this column and the one before.
 */
static int covered(const struct view *view, int x, int *ret_top, int *ret_bottom)
{
	const struct bin *bin = visible(view->plot, view->panel, x);
	const struct bin *before = x > 0 ? visible(view->plot, view->panel, x - 1) : NULL;
	double min;
	double max;

	if (bin == NULL) {
		return 0;
	}
	min = bin->min;
	max = bin->max;
	if (before != NULL) {
		double middle = (before->last + bin->first) / 2;

		min = middle < min ? middle : min;
		max = middle > max ? middle : max;
	}
	*ret_top = row_of(view, max);
	*ret_bottom = row_of(view, min);
	return 1;
}

static void put_braille(unsigned dots, FILE *out)
{
	unsigned code = 0x2800u + dots;

	fputc((int)(0xe0u | code >> 12), out);
	fputc((int)(0x80u | (code >> 6 & 0x3fu)), out);
	fputc((int)(0x80u | (code & 0x3fu)), out);
}

/* The dots of one character cell. Unicode numbers them down the left column, then the right. */
static unsigned cell_dots(const struct view *view, int cell, int row)
{
	static const unsigned bits[4][2] = { { 1, 8 }, { 2, 16 }, { 4, 32 }, { 64, 128 } };
	unsigned dots = 0;

	for (int dx = 0; dx < dots_x(view->plot); dx++) {
		int top;
		int bottom;

		if (!covered(view, cell * dots_x(view->plot) + dx, &top, &bottom)) {
			continue;
		}
		for (int dy = 0; dy < dots_y(view->plot); dy++) {
			int y = row * dots_y(view->plot) + dy;

			dots |= y >= top && y <= bottom ? bits[dy][dx] : 0;
		}
	}
	return dots;
}

static void write_label(int row, int rows, const struct span *axis, FILE *out)
{
	double value = axis->max - (axis->max - axis->min) * row / (rows - 1);

	if (row == 0 || row == rows - 1 || row == rows / 2) {
		fprintf(out, "%*.5g|", LABEL_COLUMNS - 1, value);
	} else {
		fprintf(out, "%*s|", LABEL_COLUMNS - 1, "");
	}
}

/* A flat curve runs through the middle of its panel. */
static void open_axis(struct span *axis)
{
	double magnitude = fabs(axis->max);

	if (axis->is_empty || axis->max - axis->min <= magnitude * 1e-12) {
		double pad = magnitude * 1e-9 > 1 ? magnitude * 1e-9 : 1;

		axis->min -= pad;
		axis->max += pad;
	}
}

static void write_panel(const struct plot *plot, unsigned panel, int rows, FILE *out)
{
	struct view view = {
		.plot = plot,
		.panel = panel,
		.axis = span_of(plot, panel),
		.height = rows * dots_y(plot),
	};

	if (view.axis.is_empty) {
		fprintf(out, "%s   no values yet\n", plot->spec.titles[panel]);
	} else {
		fprintf(out, "%s   now %.6g   min %.6g   max %.6g\n", plot->spec.titles[panel],
			view.axis.last, view.axis.min, view.axis.max);
	}
	open_axis(&view.axis);
	for (int row = 0; row < rows; row++) {
		write_label(row, rows, &view.axis, out);
		for (int cell = 0; cell < plot->cells; cell++) {
			unsigned dots = cell_dots(&view, cell, row);

			if (dots == 0) {
				fputc(' ', out);
			} else if (plot->spec.style == PLOT_BRAILLE) {
				put_braille(dots, out);
			} else {
				fputc('*', out);
			}
		}
		fputc('\n', out);
	}
}

static void write_axis(const struct plot *plot, FILE *out)
{
	double window_s = (double)plot->bin_ns * plot->dots / 1e9;
	char left[24];
	char middle[24];
	int half = plot->cells / 2;

	fprintf(out, "%*s+", LABEL_COLUMNS - 1, "");
	for (int i = 1; i <= plot->cells; i++) {
		fputc(i == half || i == plot->cells ? '+' : '-', out);
	}
	snprintf(left, sizeof(left), "-%.3g s", window_s);
	snprintf(middle, sizeof(middle), "-%.3g s", window_s / 2);
	fprintf(out, "\n%*s%-*s%-*s%*s\n", LABEL_COLUMNS - 1, "", half - 3, left,
		plot->cells - half, middle, 4, "now");
}

void plot_write(const struct plot *plot, int rows, FILE *out)
{
	/* Each panel has a title; below all are the axis and its labels. */
	int panel_rows = (rows - 2) / (int)plot->spec.panels - 1;

	if (panel_rows < PANEL_ROWS_MIN) {
		panel_rows = PANEL_ROWS_MIN;
	}
	for (unsigned panel = 0; panel < plot->spec.panels; panel++) {
		write_panel(plot, panel, panel_rows, out);
	}
	write_axis(plot, out);
}
