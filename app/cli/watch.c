/* SPDX-License-Identifier: MIT */
/* ecdaq watch: values of channels as lines, JSON or curves. */
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "base/clock.h"
#include "base/host_clock.h"
#include "cli/choose.h"
#include "cli/cli.h"
#include "cli/fit.h"
#include "cli/follow.h"
#include "cli/lines.h"
#include "cli/plot.h"
#include "cli/screen.h"
#include "cli/text.h"
#include "cli/value_table.h"
#include "image/image.h"
#include "program/args_duration.h"
#include "program/json.h"

#define DRAW_PERIOD_NS (NS_PER_S / 15)

enum { PANELS_LIMIT = 64 };

struct watch {
	struct cli *cli;
	struct args args;
	struct follow follow;
	struct choice choice;
	struct plot *plot; /* NULL: lines */
	const char *titles[CHOOSE_LIMIT];
	const char *units[CHOOSE_LIMIT];
	int is_paused;
	struct value_table table;
	unsigned sort; /* enum value_table_sort */
	struct screen_scroll scroll;
	int is_json;
	int is_plot;
	int is_table; /* values in place */
	int is_live;  /* plot or table has the terminal */
	int is_raw;
	int needs_head;
	uint64_t count; /* of samples; 0: no end */
	uint64_t every;
	double rate_hz;
	int64_t window_ns;
	uint64_t shown;
	uint64_t missed;
	uint64_t next_cycle; /* which should come next; 0: none came yet */
	int64_t drawn_ns;
};

static const struct channel *chosen(const struct watch *watch, unsigned i)
{
	return &watch->follow.samples.channels[watch->choice.channel[i]];
}

/* @missed samples are not there, because @why. */
static void print_gap(struct watch *watch, uint64_t missed, const char *why)
{
	struct json js;

	watch->missed += missed;
	if (watch->is_plot || watch->is_table) {
		return;
	}
	if (!watch->is_json) {
		printf("# %" PRIu64 " samples missed: %s\n", missed, why);
		return;
	}
	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "missed", missed);
	json_text(&js, "why", why);
	json_object_end(&js);
	json_end_line(&js);
}

/* --- curves --- */

static double plotted_value(const struct watch *watch, const struct channel *ch, uint64_t raw)
{
	struct channel plain = *ch;

	if (watch->is_raw) {
		plain.scale = 1.0;
		plain.offset = 0.0;
	}
	return image_raw_to_physical(&plain, raw);
}

static void add_to_plot(struct watch *watch, const struct sample_header *header)
{
	const struct samples *samples = &watch->follow.samples;
	int64_t time_ns = header->dc_time_ns != 0
				  ? header->dc_time_ns
				  : (int64_t)(header->cycle * samples->meta->period_ns);

	for (unsigned i = 0; i < watch->choice.count; i++) {
		const struct channel *ch = chosen(watch, i);

		/* A stale input would draw a flat line. */
		if (ch->direction == CHANNEL_OUTPUT || !lines_is_bad(header, ch)) {
			plot_add(watch->plot, i, time_ns,
				 plotted_value(watch, ch,
					       image_get_raw(samples_image(samples), ch)));
		}
	}
}

/* "   dt 12.5 ms (80 Hz)" with cursors, else nothing. */
static void format_cursors(const struct watch *watch, char *buf, size_t buf_len)
{
	char dt[TEXT_BYTES];
	int64_t ns = plot_cursors_ns(watch->plot);

	buf[0] = '\0';
	if (plot_cursors_are_on(watch->plot) && ns != 0) {
		snprintf(buf, buf_len, "   dt %s (%.4g Hz)", text_ns(ns, dt),
			 1e9 / fabs((double)ns));
	} else if (plot_cursors_are_on(watch->plot)) {
		snprintf(buf, buf_len, "   dt 0");
	}
}

static void format_footer(const struct watch *watch, int columns, char *buf, size_t buf_len)
{
	char cursors[64];
	char counts[64];
	int used;

	format_cursors(watch, cursors, sizeof(cursors));
	used = snprintf(buf, buf_len, "q: leave   ?: keys   %s%s",
			watch->is_paused ? "PAUSED" : "space: pause", cursors);
	if (snprintf(counts, sizeof(counts), "   cycle %" PRIu64 "   missed %" PRIu64,
		     watch->next_cycle == 0 ? 0 : watch->next_cycle - 1,
		     watch->missed) <= columns - used) {
		snprintf(buf + used, buf_len - (size_t)used, "%s", counts);
	}
}

static void draw(struct watch *watch)
{
	struct screen_size size = screen_size();
	char footer[256];
	char *text = NULL;
	size_t len = 0;
	FILE *out;

	if (!watch->is_live) {
		plot_write(watch->plot, size.rows - 1, stdout);
		return;
	}
	out = open_memstream(&text, &len);
	if (out == NULL) {
		return;
	}
	plot_resize(watch->plot, size.columns);
	plot_write(watch->plot, size.rows - 1, out);
	format_footer(watch, size.columns, footer, sizeof(footer));
	if (fclose(out) == 0) {
		screen_draw(&(struct screen_frame){
			.head = text,
			.body = "",
			.footer = footer,
			.keys = "  space            pause, continue\n"
				"  c                cursors A and B, their distance; off\n"
				"  Tab              move the other cursor\n"
				"  left, right      move it by a dot; < and >: by 10\n",
		});
	}
	free(text);
	watch->drawn_ns = host_clock_ns(CLOCK_MONOTONIC);
}

/* --- values in place --- */

static void write_table_head(const struct watch *watch, int columns, FILE *out)
{
	struct sample_header header = samples_header(&watch->follow.samples);
	char flags[128];
	char line[256];

	samples_flags_format(header.flags, flags, sizeof(flags));
	snprintf(line, sizeof(line), "cycle %" PRIu64 "   WKC %u/%u   missed %" PRIu64 "%s%s\n",
		 header.cycle, header.wkc, header.wkc_expected, watch->missed,
		 flags[0] == '\0' ? "" : "   ", flags);
	fit_write(line, columns, 2, out);
	value_table_write_heading(&watch->table, columns, out);
}

static void draw_table(struct watch *watch)
{
	static const char *const sorts[VALUE_TABLE_SORT_COUNT] = {
		[VALUE_TABLE_AS_GIVEN] = "as given",
		[VALUE_TABLE_BAD_FIRST] = "bad first",
		[VALUE_TABLE_BY_NAME] = "by name",
	};
	int columns = screen_size().columns;
	char footer[128];
	char *text[2] = { NULL, NULL };
	size_t len;
	FILE *head = open_memstream(&text[0], &len);
	FILE *body = open_memstream(&text[1], &len);

	if (head != NULL && body != NULL) {
		write_table_head(watch, columns, head);
		value_table_write(&watch->table, (enum value_table_sort)watch->sort, columns,
				  host_clock_ns(CLOCK_MONOTONIC), body);
	}
	if (head != NULL && fclose(head) == 0 && body != NULL && fclose(body) == 0) {
		snprintf(footer, sizeof(footer), "q: leave   ?: keys   %s   %u channels",
			 sorts[watch->sort], watch->choice.count);
		screen_draw(&(struct screen_frame){
			.head = text[0],
			.body = text[1],
			.footer = footer,
			.keys = "  s                next order: as given, bad first, by name\n",
			.scroll = &watch->scroll,
		});
	}
	free(text[0]);
	free(text[1]);
	watch->drawn_ns = host_clock_ns(CLOCK_MONOTONIC);
}

/* A live plot starts with the samples of its window that are in the ring, also after a pause. */
static void seek_back(struct watch *watch)
{
	struct reader *reader = watch->follow.samples.reader;
	uint64_t period_ns = watch->follow.samples.meta->period_ns;
	uint64_t back = period_ns == 0 ? 0 : (uint64_t)watch->window_ns / period_ns;
	uint64_t newest = reader_newest(reader);
	uint64_t oldest = reader_oldest(reader);

	reader_seek(reader, newest - oldest < back ? oldest : newest - back);
	watch->next_cycle = 0;
}

static void take_plot_key(struct watch *watch, int key)
{
	switch (key) {
	case ' ':
		watch->is_paused = !watch->is_paused;
		if (!watch->is_paused) {
			seek_back(watch);
		}
		break;
	case 'c':
		plot_cursors_toggle(watch->plot);
		break;
	case '\t':
		plot_cursors_switch(watch->plot);
		break;
	case SCREEN_KEY_LEFT:
	case SCREEN_KEY_RIGHT:
		plot_cursors_move(watch->plot, key == SCREEN_KEY_LEFT ? -1 : 1);
		break;
	case '<':
	case '>':
		plot_cursors_move(watch->plot, key == '<' ? -10 : 10);
		break;
	default:
		break;
	}
}

static void take_key(struct watch *watch, int key)
{
	if (!watch->is_live || key == SCREEN_KEY_NONE) {
		return;
	}
	if (watch->is_plot) {
		take_plot_key(watch, key);
	} else if (key == 's') {
		watch->sort = (watch->sort + 1) % VALUE_TABLE_SORT_COUNT;
	} else {
		screen_scroll_key(&watch->scroll, key);
	}
	watch->drawn_ns = 0; /* at once */
}

static void draw_if_due(struct watch *watch)
{
	if (!watch->is_live || watch->next_cycle == 0 ||
	    host_clock_ns(CLOCK_MONOTONIC) - watch->drawn_ns < DRAW_PERIOD_NS) {
		return;
	}
	if (watch->is_table) {
		draw_table(watch);
	} else {
		draw(watch);
	}
}

static enum exit_code begin_plot(struct watch *watch)
{
	struct plot_spec spec = {
		.panels = watch->choice.count,
		.titles = watch->titles,
		.units = watch->units,
		.window_ns = watch->window_ns,
		.columns = screen_size().columns,
		.style = screen_is_utf8() ? PLOT_BRAILLE : PLOT_ASCII,
	};

	if (watch->choice.count > PANELS_LIMIT) {
		return cli_fail(watch->cli, EXIT_CODE_FAILED, "--plot: more than %d channels",
				PANELS_LIMIT);
	}
	for (unsigned i = 0; i < watch->choice.count; i++) {
		watch->titles[i] = chosen(watch, i)->name;
		watch->units[i] = watch->is_raw ? "" : chosen(watch, i)->unit;
	}
	plot_destroy(watch->plot);
	watch->plot = plot_create(&spec);
	if (watch->plot == NULL) {
		return cli_fail(watch->cli, EXIT_CODE_FAILED, "out of memory");
	}
	if (watch->is_live) {
		seek_back(watch);
		watch->follow.idle_ns = 20 * NS_PER_MS;
	}
	return EXIT_CODE_OK;
}

/* --- both --- */

static struct lines lines_of(const struct watch *watch)
{
	return (struct lines){
		.samples = &watch->follow.samples,
		.choice = &watch->choice,
		.is_raw = watch->is_raw,
	};
}

static enum exit_code look_up(struct watch *watch)
{
	const struct sample_meta *meta = watch->follow.samples.meta;
	enum exit_code result =
		choose_channels(watch->cli, &watch->follow.samples, watch->args.operands,
				watch->args.operand_count, &watch->choice);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (watch->rate_hz > 0 && meta->period_ns > 0) {
		double every = round(1e9 / (watch->rate_hz * (double)meta->period_ns));

		watch->every = every < 1 ? 1 : every > 1e15 ? (uint64_t)1e15 : (uint64_t)every;
	}
	watch->next_cycle = 0;
	watch->needs_head = !watch->is_plot && !watch->is_json;
	if (watch->is_table) {
		value_table_init(&watch->table, &watch->follow.samples, &watch->choice,
				 watch->is_raw);
		watch->follow.idle_ns = 20 * NS_PER_MS;
	}
	return watch->is_plot ? begin_plot(watch) : EXIT_CODE_OK;
}

static void take(struct watch *watch)
{
	struct sample_header header = samples_header(&watch->follow.samples);
	struct lines lines = lines_of(watch);

	if (watch->next_cycle != 0 && header.cycle > watch->next_cycle) {
		print_gap(watch, header.cycle - watch->next_cycle, "the cycle numbers jump");
	}
	watch->next_cycle = header.cycle + 1;
	if (header.cycle % watch->every != 0) {
		return;
	}
	if (watch->is_plot) {
		add_to_plot(watch, &header);
		draw_if_due(watch);
	} else if (watch->is_table) {
		value_table_take(&watch->table);
		draw_if_due(watch);
	} else if (watch->is_json) {
		lines_write_json(&lines);
	} else {
		if (watch->needs_head) {
			lines_write_head(&lines);
			watch->needs_head = 0;
		}
		lines_write_text(&lines);
	}
	watch->shown++;
}

/* What the end of ecdaqd means: bad if it came before all that was asked for. */
static enum exit_code ended(const struct watch *watch)
{
	if (watch->count > 0) {
		return cli_fail(watch->cli, EXIT_CODE_NO_DAEMON,
				"ecdaqd has ended after %" PRIu64 " of %" PRIu64 " samples",
				watch->shown, watch->count);
	}
	if (watch->shown == 0) {
		return cli_fail(watch->cli, EXIT_CODE_NO_DAEMON,
				"ecdaqd has ended: no more samples");
	}
	return EXIT_CODE_OK;
}

/* Paused: the same values, at any size and with cursors. */
static void watch_picture(struct watch *watch)
{
	take_key(watch, screen_wait(DRAW_PERIOD_NS));
	draw(watch);
}

static enum exit_code run(struct watch *watch)
{
	uint64_t lost = 0;
	enum exit_code result;

	while (watch->count == 0 || watch->shown < watch->count) {
		enum follow_result next;

		if (watch->is_paused) {
			watch_picture(watch);
			if (screen_is_over()) {
				return EXIT_CODE_OK;
			}
			continue;
		}
		next = follow_next(&watch->follow, &lost);
		take_key(watch, watch->follow.key);
		switch (next) {
		case FOLLOW_SAMPLE:
			take(watch);
			break;
		case FOLLOW_LOST:
			print_gap(watch, lost, "this reader is too slow");
			watch->next_cycle = 0;
			break;
		case FOLLOW_IDLE:
			fflush(stdout);
			draw_if_due(watch);
			if (ferror(stdout)) {
				return EXIT_CODE_OK; /* main() reports why */
			}
			break;
		case FOLLOW_NEW_BUS:
			result = look_up(watch);
			if (result != EXIT_CODE_OK) {
				return result;
			}
			break;
		case FOLLOW_ENDED:
			return ended(watch);
		case FOLLOW_DAMAGED:
			return cli_fail(watch->cli, EXIT_CODE_FAILED, "samples: %s",
					reader_error_to_str(-EIO));
		case FOLLOW_OVER:
			return EXIT_CODE_OK;
		}
	}
	return EXIT_CODE_OK;
}

static enum exit_code begin(struct watch *watch)
{
	enum exit_code result = follow_open(watch->cli, &watch->follow);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = look_up(watch);
	if (result == EXIT_CODE_OK) {
		screen_catch_signals();
		if (watch->is_live) {
			screen_begin();
		}
		result = run(watch);
		screen_end();
	}
	if (watch->plot != NULL && watch->shown > 0) {
		watch->is_live = 0;
		draw(watch);
	}
	plot_destroy(watch->plot);
	follow_close(&watch->follow);
	return result;
}

enum exit_code verb_watch(struct cli *cli, int argc, char **argv)
{
	struct watch watch = { .cli = cli, .window_ns = 5 * NS_PER_S };
	const struct args_option options[] = {
		{ "plot", 'p', args_flag, &watch.is_plot, NULL,
		  "scrolling curves, one panel per channel" },
		{ "window", 'w', args_duration, &watch.window_ns, "T",
		  "time across the plot (5s)" },
		{ "count", 'n', args_count, &watch.count, "N", "end after N samples" },
		{ "every", 0, args_count, &watch.every, "N",
		  "a line every N-th cycle, also on a terminal" },
		{ "rate", 0, args_number, &watch.rate_hz, "HZ", "about HZ samples per second" },
		{ "raw", 0, args_flag, &watch.is_raw, NULL,
		  "raw counts, not in the channel's unit" },
		{ "json", 0, args_flag, &watch.is_json, NULL, "one JSON object per sample" },
	};
	enum exit_code result;

	watch.args = (struct args){
		.options = options,
		.option_count = sizeof(options) / sizeof(options[0]),
		.operands_min = 1,
		.operands_max = INT_MAX,
	};
	if (!cli_parse(cli, &watch.args, argc, argv, &result)) {
		return result;
	}
	if (watch.is_plot && watch.is_json) {
		return cli_fail(cli, EXIT_CODE_USAGE, "--plot and --json exclude each other");
	}
	if (watch.rate_hz > 0 && watch.every > 0) {
		return cli_fail(cli, EXIT_CODE_USAGE, "--rate and --every exclude each other");
	}
	watch.is_table = screen_is_terminal() && !watch.is_plot && !watch.is_json &&
			 watch.every == 0 && watch.rate_hz <= 0 && watch.count == 0;
	watch.every = watch.every == 0 ? 1 : watch.every;
	watch.is_live = watch.is_table || (watch.is_plot && screen_is_terminal());
	return begin(&watch);
}
