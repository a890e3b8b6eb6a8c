/* SPDX-License-Identifier: MIT */
/* ecdaq histogram */
#include "base/histogram.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/args.h"
#include "base/clock.h"
#include "base/host_clock.h"
#include "cli/bars.h"
#include "cli/cli.h"
#include "cli/fit.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "cli/text.h"
#include "program/args_duration.h"
#include "program/json.h"
#include "reader/page.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

/* So many rows of bars an octave: each holds a quarter of it. */
enum { ROWS_PER_OCTAVE = 4, BUCKETS_PER_ROW = (1 << HISTOGRAM_SUB_BITS) / ROWS_PER_OCTAVE };
/* Columns before a bar. */
enum { BAR_INDENT = 43 };
enum { ROWS = HISTOGRAM_BUCKETS / BUCKETS_PER_ROW };

static const char *const names[] = { "wake", "round-trip", "phase", "work", "control" };

enum { NAMES = sizeof(names) / sizeof(names[0]) };

static const struct histogram *histogram_of(const struct status_page *page, unsigned which)
{
	const struct cycle_stats *st = &page->cycle;
	const struct histogram *const all[NAMES] = { &st->wake_latency, &st->round_trip, &st->phase,
						     &st->work, &page->control.time };

	return all[which];
}

/* --- bars --- */

struct rows {
	uint64_t count[ROWS];
	uint64_t total;
	uint64_t largest;
	unsigned first; /* with anything in it */
	unsigned last;
};

static void gather(const struct histogram *h, struct rows *ret)
{
	struct rows rows = { .first = ROWS };

	for (unsigned row = 0; row < ROWS; row++) {
		for (unsigned b = 0; b < BUCKETS_PER_ROW; b++) {
			rows.count[row] += GET(h->bucket[row * BUCKETS_PER_ROW + b]);
		}
		rows.total += rows.count[row];
		rows.largest = rows.count[row] > rows.largest ? rows.count[row] : rows.largest;
		if (rows.count[row] > 0) {
			rows.first = rows.first == ROWS ? row : rows.first;
			rows.last = row;
		}
	}
	*ret = rows;
}

static void write_heading(FILE *out)
{
	fprintf(out, "%10s   %10s %10s %6s  bars: logarithmic\n", "from", "below", "count",
		"up to");
}

static void write_rows(const struct rows *rows, int columns, FILE *out)
{
	int width = columns - BAR_INDENT < 10 ? 10 : columns - BAR_INDENT;
	uint64_t below = 0;
	char from[TEXT_BYTES];
	char to[TEXT_BYTES];

	for (unsigned row = rows->first; rows->total > 0 && row <= rows->last; row++) {
		/* One value must be seen next to a million. */
		double share = log1p((double)rows->count[row]) / log1p((double)rows->largest);
		int bar = rows->count[row] == 0 ? 0 : (int)lround(share * width);

		below += rows->count[row];
		fprintf(out, "%10s   %10s %10" PRIu64 " %5.1f%%  ",
			text_ns(histogram_bucket_floor(row * BUCKETS_PER_ROW), from),
			text_ns(histogram_bucket_floor((row + 1) * BUCKETS_PER_ROW), to),
			rows->count[row], 100.0 * (double)below / (double)rows->total);
		for (int i = 0; i < (bar == 0 && rows->count[row] > 0 ? 1 : bar); i++) {
			fputc('#', out);
		}
		fputc('\n', out);
	}
}

static void write_totals(const struct histogram *h, const struct rows *rows, FILE *out)
{
	char value[TEXT_BYTES];

	if (rows->total == 0) {
		fputs("no values yet\n", out);
		return;
	}
	fprintf(out, "%" PRIu64 " values, p50 %s, ", rows->total,
		text_ns(histogram_percentile(h, 500000), value));
	fprintf(out, "p99.9 %s, ", text_ns(histogram_percentile(h, 999000), value));
	fprintf(out, "largest %s\n", text_ns(histogram_max_magnitude(h), value));
}

void bars_print(const struct histogram *h)
{
	struct rows rows;

	gather(h, &rows);
	if (rows.total > 0) {
		write_heading(stdout);
		write_rows(&rows, screen_size().columns, stdout);
	}
	write_totals(h, &rows, stdout);
}

/* --- JSON --- */

static void print_json(const struct histogram *h, const char *name)
{
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_text(&js, "histogram", name);
	json_u64(&js, "count", GET(h->count));
	json_i64(&js, "min_ns", GET(h->min_ns));
	json_i64(&js, "max_ns", GET(h->max_ns));
	json_i64(&js, "sum_ns", GET(h->sum_ns));
	json_i64(&js, "p50_ns", histogram_percentile(h, 500000));
	json_i64(&js, "p99_ns", histogram_percentile(h, 990000));
	json_i64(&js, "p999_ns", histogram_percentile(h, 999000));
	json_array_begin(&js, "bucket");
	for (unsigned b = 0; b < HISTOGRAM_BUCKETS; b++) {
		if (GET(h->bucket[b]) == 0) {
			continue;
		}
		json_object_begin(&js, NULL);
		json_i64(&js, "from_ns", histogram_bucket_floor(b));
		json_i64(&js, "below_ns", histogram_bucket_floor(b + 1));
		json_u64(&js, "count", GET(h->bucket[b]));
		json_object_end(&js);
	}
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}

/* --- again and again --- */

struct view {
	struct cli *cli;
	const struct status_page *page;
	unsigned which; /* of names[] */
	int is_json;
	int is_screen; /* on a terminal: in place, with keys */
	int64_t interval_ns;
	uint64_t count; /* of updates; 0: no end */
	uint64_t shown;
	struct screen_scroll scroll;
};

static void write_head(const struct view *view, const struct rows *rows, FILE *out)
{
	struct fit fit;
	FILE *text = fit_begin(&fit, screen_size().columns, out);

	fprintf(text, "%s: ", names[view->which]);
	write_totals(histogram_of(view->page, view->which), rows, text);
	fit_end(&fit, 4);
	write_heading(out);
}

/* The head, or the body; NULL without memory. Free with free(). */
static char *text_of(const struct view *view, const struct rows *rows, int is_head)
{
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);

	if (out == NULL) {
		return NULL;
	}
	if (is_head) {
		write_head(view, rows, out);
	} else {
		write_rows(rows, screen_size().columns, out);
	}
	if (fclose(out) != 0) {
		free(text);
		return NULL;
	}
	return text;
}

static void draw_once(struct view *view, const char *head, const char *body)
{
	const struct screen_scroll *scroll = &view->scroll;
	char footer[128] = "q: leave   ?: keys   left, right: another one";
	struct screen_frame frame = {
		.head = head,
		.body = body,
		.footer = footer,
		.keys = "  left, right      the histogram before, behind: wake, round-trip, "
			"phase,\n"
			"                   work, control\n",
		.scroll = &view->scroll,
	};

	if (scroll->count > scroll->visible) {
		snprintf(footer, sizeof(footer), "q: leave   ?: keys   rows %d-%d of %d",
			 scroll->first + 1, scroll->first + scroll->visible, scroll->count);
	}
	screen_draw(&frame);
}

static void draw(struct view *view)
{
	struct rows rows;
	char *head;
	char *body;

	gather(histogram_of(view->page, view->which), &rows);
	head = text_of(view, &rows, 1);
	body = text_of(view, &rows, 0);
	if (head != NULL && body != NULL) {
		struct screen_scroll before = view->scroll;

		draw_once(view, head, body);
		/* What has room is known now. */
		if (before.first != view->scroll.first || before.visible != view->scroll.visible ||
		    before.count != view->scroll.count) {
			draw_once(view, head, body);
		}
	}
	free(head);
	free(body);
}

static void print_once(const struct view *view)
{
	const struct histogram *h = histogram_of(view->page, view->which);

	if (view->is_json) {
		print_json(h, names[view->which]);
	} else {
		fputs(view->shown > 0 ? "\n" : "", stdout);
		bars_print(h);
	}
	fflush(stdout);
}

static void take_key(struct view *view, int key)
{
	if (key == SCREEN_KEY_RIGHT || key == SCREEN_KEY_LEFT) {
		view->which = (view->which + (key == SCREEN_KEY_RIGHT ? 1 : NAMES - 1)) % NAMES;
		view->scroll.first = 0;
	} else {
		screen_scroll_key(&view->scroll, key);
	}
}

/* The interval; keys and a new size take effect in it. */
static void wait_interval(struct view *view)
{
	int64_t until_ns = host_clock_ns(CLOCK_MONOTONIC) + view->interval_ns;
	int64_t left_ns = view->interval_ns;

	while (!screen_is_over() && left_ns > 0) {
		take_key(view, screen_wait(left_ns));
		left_ns = until_ns - host_clock_ns(CLOCK_MONOTONIC);
		if (view->is_screen && !screen_is_over() && left_ns > 0) {
			draw(view);
		}
	}
}

/* Until so many updates were shown, the user ends it, or ecdaqd is gone. */
static void follow(struct view *view)
{
	int is_last;

	if (view->is_screen) {
		screen_begin();
	} else {
		screen_catch_signals();
	}
	do {
		if (view->is_screen) {
			draw(view);
		} else {
			print_once(view);
		}
		view->shown++;
		is_last = !page_is_alive(view->page->pid) || view->shown == view->count;
		if (!is_last) {
			wait_interval(view);
		}
	} while (!is_last && !screen_is_over() && source_refresh_status(view->cli, &view->page));
	screen_end();
	/* Leave the last one in the terminal: the other screen buffer is gone. */
	if (view->is_screen && !screen_is_over()) {
		bars_print(histogram_of(view->page, view->which));
	}
}

/* --- the verb --- */

enum exit_code verb_histogram(struct cli *cli, int argc, char **argv)
{
	struct view view = { .cli = cli };
	int is_live = 0;
	const struct args_option options[] = {
		{ "live", 'l', args_flag, &is_live, NULL,
		  "again and again; on a terminal in place, with keys (?)" },
		{ "interval", 'i', args_duration, &view.interval_ns, "T",
		  "the same, with this time between updates (500ms)" },
		{ "count", 'n', args_count, &view.count, "N", "the same, and end after N updates" },
		{ "json", 0, args_flag, &view.is_json, NULL,
		  "all buckets as one JSON object, one an update" },
	};
	struct args args = {
		.options = options, .option_count = 4, .operands_min = 1, .operands_max = 1
	};
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	while (view.which < NAMES && strcmp(names[view.which], args.operands[0]) != 0) {
		view.which++;
	}
	result = source_status(cli, &view.page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	is_live = is_live || view.interval_ns > 0 || view.count > 0;
	view.interval_ns = view.interval_ns > 0 ? view.interval_ns : NS_PER_S / 2;
	view.is_screen = screen_is_terminal() && !view.is_json;
	if (view.which == NAMES) {
		result = cli_fail(cli, EXIT_CODE_USAGE,
				  "%s: expected wake, round-trip, phase, work or control",
				  args.operands[0]);
	} else if (is_live) {
		follow(&view);
	} else {
		print_once(&view);
	}
	source_status_close(view.page);
	return result;
}
