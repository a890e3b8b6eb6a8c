/* SPDX-License-Identifier: MIT */
#include "cli/plot.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli/fit.h"

enum { LABEL_COLUMNS = 11, COLUMNS_MIN = 20, PANEL_ROWS_MIN = 4 };
/* A window has so many bins, whatever the width: what is drawn can be drawn anew. A dot column
 * holds one or several. */
enum { BINS = 2048, BINS_KEPT = BINS + BINS / 8, DOTS_LIMIT = BINS };

/* All values of one short time, or of one dot column. */
struct bin {
	int64_t number; /* which since the start of time; -1: no values */
	double min;
	double max;
	double first;
	double last;
	int filled; /* of a dot column: bins with values */
};

struct plot {
	struct plot_spec spec;
	int cells; /* characters across */
	int dots;  /* dot columns across */
	int64_t bin_ns;
	int64_t newest_bin; /* -1: none yet */
	struct bin *bins;   /* panels * BINS_KEPT, each panel a ring by number */
	int are_cursors_on;
	int moved;     /* the cursor that is moved */
	int cursor[2]; /* bins before the newest one */
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
	for (size_t i = 0; i < (size_t)BINS_KEPT * plot->spec.panels; i++) {
		plot->bins[i].number = -1;
	}
}

void plot_resize(struct plot *plot, int columns)
{
	plot->spec.columns = columns < COLUMNS_MIN ? COLUMNS_MIN : columns;
	plot->cells = plot->spec.columns - LABEL_COLUMNS - 1;
	if (plot->cells * dots_x(plot) > DOTS_LIMIT) {
		plot->cells = DOTS_LIMIT / dots_x(plot);
	}
	plot->dots = plot->cells * dots_x(plot);
}

struct plot *plot_create(const struct plot_spec *spec)
{
	struct plot *plot = calloc(1, sizeof(*plot));

	if (plot == NULL) {
		return NULL;
	}
	plot->spec = *spec;
	plot_resize(plot, spec->columns);
	plot->bin_ns = spec->window_ns / BINS;
	if (plot->bin_ns < 1) {
		plot->bin_ns = 1;
	}
	plot->cursor[0] = BINS * 2 / 3;
	plot->cursor[1] = BINS / 3;
	plot->bins = calloc((size_t)BINS_KEPT * spec->panels, sizeof(*plot->bins));
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
	return &plot->bins[(size_t)panel * BINS_KEPT + (size_t)(number % BINS_KEPT)];
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

/* Columns are fixed in time, as bins are: the curve moves by whole ones. */
static int64_t column_of(const struct plot *plot, int64_t bin)
{
	return bin / BINS * plot->dots + bin % BINS * plot->dots / BINS;
}

/* The first bin of a column. */
static int64_t bin_of(const struct plot *plot, int64_t column)
{
	return column / plot->dots * BINS +
	       (column % plot->dots * BINS + plot->dots - 1) / plot->dots;
}

/* The values of dot column @x; number -1: it has none. */
static struct bin gather(const struct plot *plot, unsigned panel, int x)
{
	struct bin sum = { .number = -1 };
	int64_t column = column_of(plot, plot->newest_bin) - (plot->dots - 1 - x);
	int64_t end;

	if (plot->newest_bin < 0 || column < 0) {
		return sum;
	}
	end = bin_of(plot, column + 1);
	for (int64_t number = bin_of(plot, column); number < end; number++) {
		const struct bin *bin = bin_at(plot, panel, number);

		if (bin->number != number) {
			continue;
		}
		if (sum.number < 0) {
			sum = *bin;
		}
		sum.min = bin->min < sum.min ? bin->min : sum.min;
		sum.max = bin->max > sum.max ? bin->max : sum.max;
		sum.last = bin->last;
		sum.filled++;
	}
	return sum;
}

/* Where a column has hardly more than one value, one may stay without by rounding: no hole. */
static void bridge(struct bin *columns, int count)
{
	for (int x = 1; x + 1 < count; x++) {
		const struct bin *before = &columns[x - 1];

		if (columns[x].number < 0 && before->number >= 0 && columns[x + 1].number >= 0 &&
		    before->filled <= 2 && columns[x + 1].filled <= 2) {
			columns[x] = *before;
			columns[x].min = before->last;
			columns[x].max = before->last;
			columns[x].first = before->last;
		}
	}
}

struct span {
	double min;
	double max;
	double last;
	double step; /* of the ticks; 0: none, the axis ends anywhere */
	int is_empty;
};

static struct span span_of(const struct bin *columns, int count)
{
	struct span span = { .is_empty = 1 };

	for (int x = 0; x < count; x++) {
		const struct bin *bin = &columns[x];

		if (bin->number < 0) {
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
	const struct bin *columns; /* of dots */
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
	const struct bin *bin = &view->columns[x];
	const struct bin *before = x > 0 && bin[-1].number >= 0 ? bin - 1 : NULL;
	double min;
	double max;

	if (bin->number < 0) {
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

/* --- axes --- */

/* 1, 2 or 5 times a power of ten: @span has at most @count of it, or one more; 0: there is none. */
static double round_step(double span, int count)
{
	double least = span / (count < 1 ? 1 : count);
	double power = pow(10, floor(log10(least)));
	double times = least / power;

	if (!isfinite(least) || least <= 0 || !isnormal(power)) {
		return 0;
	}
	return (times <= 1 ? 1 : times <= 2 ? 2 : times <= 5 ? 5 : 10) * power;
}

/* Let @axis end at ticks, of which @rows have room for some. */
static void round_axis(struct span *axis, int rows)
{
	int count = (rows - 1) / 2;
	double step = round_step(axis->max - axis->min, count > 5 ? 5 : count);
	double min = floor(axis->min / step + 1e-9) * step;
	double max = ceil(axis->max / step - 1e-9) * step;

	if (step > 0 && isfinite(min) && isfinite(max) && max > min &&
	    (max - min) / step < 2 * (double)rows) {
		axis->min = min;
		axis->max = max;
		axis->step = step;
	}
}

static void format_tick(double value, double step, char *buf, size_t buf_len)
{
	int decimals = step > 0 && step < 1 ? (int)ceil(-log10(step) - 1e-9) : 0;

	value = fabs(value) < step / 2 ? 0 : value; /* no "-0" */
	if (step <= 0 || decimals > 6 ||
	    snprintf(buf, buf_len, "%.*f", decimals, value) >= LABEL_COLUMNS) {
		snprintf(buf, buf_len, "%.4g", value);
	}
}

static void write_label(int row, int rows, const struct span *axis, FILE *out)
{
	char text[32] = "";

	if (axis->step > 0) {
		int count = (int)lround((axis->max - axis->min) / axis->step);

		for (int i = 0; i <= count; i++) {
			if (lround((double)(count - i) / count * (rows - 1)) == row) {
				format_tick(axis->min + i * axis->step, axis->step, text,
					    sizeof(text));
			}
		}
	} else if (row == 0 || row == rows - 1 || row == rows / 2) {
		format_tick(axis->max - (axis->max - axis->min) * row / (rows - 1), 0, text,
			    sizeof(text));
	}
	fprintf(out, "%*s|", LABEL_COLUMNS - 1, text);
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

/* --- cursors --- */

void plot_cursors_toggle(struct plot *plot)
{
	plot->are_cursors_on = !plot->are_cursors_on;
}

int plot_cursors_are_on(const struct plot *plot)
{
	return plot->are_cursors_on;
}

void plot_cursors_switch(struct plot *plot)
{
	plot->moved = !plot->moved;
}

/* The dot column of a cursor. */
static int cursor_dot(const struct plot *plot, int which)
{
	return plot->dots - 1 - plot->cursor[which] * plot->dots / BINS;
}

void plot_cursors_move(struct plot *plot, int dots)
{
	int dot = cursor_dot(plot, plot->moved) + dots;

	dot = dot < 0 ? 0 : dot >= plot->dots ? plot->dots - 1 : dot;
	/* The first of the bins that are at this dot. */
	plot->cursor[plot->moved] = ((plot->dots - 1 - dot) * BINS + plot->dots - 1) / plot->dots;
}

int64_t plot_cursors_ns(const struct plot *plot)
{
	return (plot->cursor[0] - plot->cursor[1]) * plot->bin_ns;
}

/* Which cursors are in a cell: bit 0 A, bit 1 B. */
static int cursors_in(const struct plot *plot, int cell)
{
	int found = 0;

	for (int which = 0; plot->are_cursors_on && which < 2; which++) {
		found |= (cursor_dot(plot, which) / dots_x(plot) == cell) << which;
	}
	return found;
}

/* --- panels --- */

/* What is behind the name of a panel. */
static void format_figures(const struct view *view, char *buf, size_t buf_len)
{
	const struct plot *plot = view->plot;
	const char *unit = plot->spec.units == NULL ? "" : plot->spec.units[view->panel];
	const char *blank = unit[0] == '\0' ? "" : " ";
	const struct bin *a = &view->columns[cursor_dot(plot, 0)];
	const struct bin *b = &view->columns[cursor_dot(plot, 1)];

	if (view->axis.is_empty) {
		snprintf(buf, buf_len, "   no values yet");
	} else if (!plot->are_cursors_on) {
		snprintf(buf, buf_len, "   now %.6g%s%s   min %.6g   max %.6g", view->axis.last,
			 blank, unit, view->axis.min, view->axis.max);
	} else if (a->number < 0 || b->number < 0) {
		snprintf(buf, buf_len, "   no value at a cursor");
	} else {
		snprintf(buf, buf_len, "   A %.6g   B %.6g   dy %.6g%s%s", a->last, b->last,
			 b->last - a->last, blank, unit);
	}
}

static void write_title(const struct view *view, FILE *out)
{
	const struct plot *plot = view->plot;
	const char *title = plot->spec.titles[view->panel];
	char figures[160];
	char name[128];
	int room;

	format_figures(view, figures, sizeof(figures));
	room = plot->spec.columns - fit_width(figures);
	fprintf(out, "%s%s\n", fit_name(title, room < 8 ? 8 : room, name, sizeof(name)), figures);
}

static void write_cell(const struct view *view, int cell, int row, FILE *out)
{
	unsigned dots = cell_dots(view, cell, row);

	if (dots != 0 && view->plot->spec.style == PLOT_BRAILLE) {
		put_braille(dots, out);
	} else if (dots != 0) {
		fputc('*', out);
	} else {
		fputc(cursors_in(view->plot, cell) != 0 ? '|' : ' ', out);
	}
}

static void write_panel(const struct plot *plot, unsigned panel, int rows, FILE *out)
{
	struct bin columns[DOTS_LIMIT] = { 0 };
	struct view view = {
		.plot = plot,
		.panel = panel,
		.columns = columns,
		.height = rows * dots_y(plot),
	};

	for (int x = 0; x < plot->dots; x++) {
		columns[x] = gather(plot, panel, x);
	}
	bridge(columns, plot->dots);
	view.axis = span_of(columns, plot->dots);
	write_title(&view, out);
	open_axis(&view.axis);
	round_axis(&view.axis, rows);
	for (int row = 0; row < rows; row++) {
		write_label(row, rows, &view.axis, out);
		for (int cell = 0; cell < plot->cells; cell++) {
			write_cell(&view, cell, row, out);
		}
		fputc('\n', out);
	}
}

/* Put @text over @line, its middle at @at, unless it would touch another. */
static void put_centred(char *line, int columns, int at, const char *text)
{
	int len = (int)strlen(text);
	int from = at - len / 2;

	from = from + len > columns ? columns - len : from;
	if (from < 1 || from + len > columns) {
		return;
	}
	for (int i = from - 1; i <= from + len && i < columns; i++) {
		if (line[i] != ' ') {
			return;
		}
	}
	memcpy(line + from, text, (size_t)len);
}

/* The time axis and its labels, from now to the left. */
static void write_axis(const struct plot *plot, FILE *out)
{
	double window_s = (double)plot->spec.window_ns / 1e9;
	double step_s = round_step(window_s, plot->cells / 14);
	double unit_s = window_s >= 1 ? 1 : window_s >= 1e-3 ? 1e-3 : 1e-6;
	const char *unit = window_s >= 1 ? "s" : window_s >= 1e-3 ? "ms" : "us";
	char ticks[LABEL_COLUMNS + DOTS_LIMIT + 1];
	char labels[LABEL_COLUMNS + DOTS_LIMIT + 1];
	int columns = LABEL_COLUMNS + plot->cells;
	int count = step_s > 0 ? (int)(window_s / step_s + 1e-3) : 0;

	memset(ticks, ' ', (size_t)columns);
	memset(labels, ' ', (size_t)columns);
	memset(ticks + LABEL_COLUMNS, '-', (size_t)plot->cells);
	ticks[LABEL_COLUMNS - 1] = '+';
	ticks[columns] = '\0';
	labels[columns] = '\0';
	for (int i = 0; i <= count; i++) {
		int cell = plot->cells - 1 - (int)lround(i * step_s / window_s * plot->cells);
		int at = LABEL_COLUMNS + (cell < 0 ? 0 : cell);
		char text[32];

		snprintf(text, sizeof(text), "-%.4g %s", i * step_s / unit_s, unit);
		ticks[at] = '+';
		put_centred(labels, columns, at, i == 0 ? "now" : text);
	}
	for (int cell = 0; cell < plot->cells; cell++) {
		int found = cursors_in(plot, cell);

		if (found != 0) {
			ticks[LABEL_COLUMNS + cell] = (found & 1) != 0 ? 'A' : 'B';
		}
	}
	fprintf(out, "%s\n%s\n", ticks, labels);
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
