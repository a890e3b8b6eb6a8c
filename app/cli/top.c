/* SPDX-License-Identifier: MIT */
/* ecdaq top: the status screen again and again, or a line an interval. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/host_clock.h"
#include "cli/cli.h"
#include "cli/report.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "cli/text.h"
#include "program/args_duration.h"
#include "reader/page.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { FOOTER_BYTES = 3 * CONFIG_PATH_BYTES, FOOTER_ROWS = 3, SLAVES_MIN = 6 };

struct top {
	struct cli *cli;
	int64_t interval_ns;
	int64_t wait_ns; /* for ecdaqd to appear */
	const char *leave_text;
	char footer[FOOTER_BYTES];
	const char *sort_word; /* --sort; NULL: the default */
	unsigned sort;         /* enum report_sort */
	int detail;            /* enum report_detail, or -1: what the rows have room for */
	struct screen_scroll scroll;
	int is_json;
	int is_live;    /* a screen, not lines */
	uint64_t count; /* of updates; 0: no end */
	uint64_t shown; /* updates */
	uint64_t cycles_before;
	uint64_t lost_before;
};

/* How a shell in the same working directory calls this program. */
static void program_path(char path[CONFIG_PATH_BYTES])
{
	char exe[CONFIG_PATH_BYTES] = "";
	char cwd[CONFIG_PATH_BYTES] = "";
	ssize_t exe_len = readlink("/proc/self/exe", exe, sizeof(exe) - 1);
	ssize_t cwd_len = readlink("/proc/self/cwd", cwd, sizeof(cwd) - 1);
	size_t len = strlen(cwd);

	if (exe_len < 0 || strchr(program_invocation_name, '/') == NULL) {
		snprintf(path, CONFIG_PATH_BYTES, "ecdaq");
		return;
	}
	if (cwd_len > 1 && strncmp(exe, cwd, len) == 0 && exe[len] == '/') {
		snprintf(path, CONFIG_PATH_BYTES, "%s", exe + len + 1);
	} else {
		snprintf(path, CONFIG_PATH_BYTES, "%s", exe);
	}
}

/* What q does, where the list is, and the line for a second terminal where that must name the run
 * directory. */
static void make_footer(struct top *top, int columns)
{
	static const char head[] = "2nd terminal: ";
	char program[CONFIG_PATH_BYTES];
	const struct screen_scroll *scroll = &top->scroll;
	const char *dir = top->cli->dir;
	int dir_len = (int)strlen(dir);
	int used = snprintf(top->footer, FOOTER_BYTES, "%s   Ctrl-Z: suspend   ?: keys",
			    top->leave_text);
	int len;

	if (scroll->count > scroll->visible) {
		char place[64];
		int place_len =
			snprintf(place, sizeof(place), "   rows %d-%d of %d", scroll->first + 1,
				 scroll->first + scroll->visible, scroll->count);

		used = used + place_len > columns ? (int)strlen(top->leave_text) : used;
		used += snprintf(top->footer + used, (size_t)(FOOTER_BYTES - used), "%s", place);
	}
	if (!top->cli->is_dir_chosen) {
		return;
	}
	dir_len -= dir_len > 1 && dir[dir_len - 1] == '/';
	program_path(program);
	len = (int)(strlen(head) + strlen(program) + strlen(" --run-dir  status")) + dir_len;
	snprintf(top->footer + used, (size_t)(FOOTER_BYTES - used),
		 "\n%s%s%s --run-dir %.*s status", head, program, len > columns ? " \\\n " : "",
		 dir_len, dir);
}

/* What @write writes, or NULL without memory. Free with free(). */
static char *text_of(const struct report *report, const struct top *top, enum report_detail detail,
		     void (*write)(const struct report *report, const struct top *top,
				   enum report_detail detail, FILE *out))
{
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);

	if (out == NULL) {
		return NULL;
	}
	write(report, top, detail, out);
	if (fclose(out) != 0) {
		free(text);
		return NULL;
	}
	return text;
}

static void write_head(const struct report *report, const struct top *top,
		       enum report_detail detail, FILE *out)
{
	(void)top;
	report_write_head(report, detail, screen_size().columns, out);
	report_write_slaves_heading(report, screen_size().columns, out);
}

static void write_body(const struct report *report, const struct top *top,
		       enum report_detail detail, FILE *out)
{
	(void)detail;
	report_write_slaves(report, (enum report_sort)top->sort, screen_size().columns, out);
}

static int line_count(const char *text)
{
	int count = 0;

	for (; *text != '\0'; text++) {
		count += *text == '\n';
	}
	return count;
}

/* The head, with all lines if there is room for them and for some slaves. */
static char *make_head(const struct top *top, const struct report *report, int slave_lines)
{
	int rows = screen_size().rows - FOOTER_ROWS;
	int is_full = top->detail != REPORT_SHORT;
	char *head = text_of(report, top, is_full ? REPORT_FULL : REPORT_SHORT, write_head);

	if (head != NULL && top->detail < 0 &&
	    line_count(head) + (slave_lines < SLAVES_MIN ? slave_lines : SLAVES_MIN) > rows) {
		free(head);
		head = text_of(report, top, REPORT_SHORT, write_head);
	}
	return head;
}

static void show_screen(struct top *top, const struct report *report)
{
	char *body = text_of(report, top, REPORT_FULL, write_body);
	char *head = body == NULL ? NULL : make_head(top, report, line_count(body));
	struct screen_frame frame = {
		.head = head,
		.body = body,
		.footer = top->footer,
		.keys = "  s                next order of the slaves: trouble, name, bad, errors, "
			"position\n"
			"  d                details: all, few, what fits\n",
		.scroll = &top->scroll,
	};

	if (head != NULL && body != NULL) {
		int first = top->scroll.first;
		int visible = top->scroll.visible;

		make_footer(top, screen_size().columns);
		screen_draw(&frame);
		if (top->scroll.first != first || top->scroll.visible != visible) {
			make_footer(top, screen_size().columns);
			screen_draw(&frame);
		}
	}
	free(head);
	free(body);
}

static void show_line(struct top *top, const struct report *report)
{
	const struct cycle_stats *st = &report->page->cycle;
	uint64_t cycles = GET(st->cycles);
	uint64_t lost = GET(st->frames_lost);
	char wake[TEXT_BYTES];
	char trip[TEXT_BYTES];
	char phase[TEXT_BYTES];

	if (top->shown == 0) {
		printf("%-10s %12s %8s %8s %8s %8s %8s %11s %11s %11s\n", "state", "cycle",
		       "+cycles", "+lost", "late", "overruns", "bad", "wake p99.9", "trip p99.9",
		       "phase p99.9");
	}
	printf("%-10s %12" PRIu64 " %8" PRIu64 " %8" PRIu64 " %8" PRIu64 " %8" PRIu64 " %8" PRIu64
	       " %11s %11s %11s\n",
	       bus_state_to_str(GET(report->page->bus_state)), GET(st->cycle_number),
	       top->shown == 0 ? 0 : cycles - top->cycles_before,
	       top->shown == 0 ? 0 : lost - top->lost_before, GET(st->frames_late),
	       GET(st->overruns), GET(st->samples_bad),
	       text_ns(histogram_percentile(&st->wake_latency, 999000), wake),
	       text_ns(histogram_percentile(&st->round_trip, 999000), trip),
	       text_ns(histogram_percentile(&st->phase, 999000), phase));
	fflush(stdout);
	top->cycles_before = cycles;
	top->lost_before = lost;
}

static void show(struct top *top, const struct report *report)
{
	struct json js;

	if (top->is_json) {
		json_init(&js, stdout);
		report_write_json(report, &js);
		json_end_line(&js);
		fflush(stdout);
	} else if (top->is_live) {
		show_screen(top, report);
	} else {
		show_line(top, report);
	}
}

static void take_key(struct top *top, int key)
{
	if (screen_scroll_key(&top->scroll, key)) {
		return;
	}
	if (key == 's') {
		top->sort = (top->sort + 1) % REPORT_SORT_COUNT;
		top->scroll.first = 0;
	} else if (key == 'd') {
		top->detail = top->detail < 0              ? REPORT_FULL
			      : top->detail == REPORT_FULL ? REPORT_SHORT
							   : -1;
	}
}

/* The interval; keys and a new size take effect in it. */
static void wait_interval(struct top *top, const struct report *report)
{
	int64_t until_ns = host_clock_ns(CLOCK_MONOTONIC) + top->interval_ns;

	while (!screen_is_over()) {
		int64_t left_ns = until_ns - host_clock_ns(CLOCK_MONOTONIC);

		if (left_ns <= 0) {
			return;
		}
		take_key(top, screen_wait(left_ns));
		if (top->is_live && !screen_is_over() &&
		    host_clock_ns(CLOCK_MONOTONIC) < until_ns) {
			show_screen(top, report);
		}
	}
}

static enum exit_code follow(struct top *top, const struct status_page **page)
{
	const struct record_status *record;
	struct report report;
	int is_last;

	do {
		/* The recorder may come, go and come back. */
		record = source_record(top->cli);
		report_gather(top->cli, *page, record, &report);
		show(top, &report);
		top->shown++;
		is_last = !report.is_running || top->shown == top->count;
		if (!is_last) {
			wait_interval(top, &report);
		}
		report_release(&report);
		source_record_close(record);
	} while (!is_last && !screen_is_over() && source_refresh_status(top->cli, page));
	screen_end();
	/* Leave the last state in the terminal: the other screen buffer is gone. */
	if (top->is_live && !screen_is_over()) {
		record = source_record(top->cli);
		report_gather(top->cli, *page, record, &report);
		report_write_screen(&report, screen_columns(), stdout);
		report_release(&report);
		source_record_close(record);
	}
	return EXIT_CODE_OK;
}

/* Is there a page that cannot change any more, or none? */
static int is_worth_waiting(struct top *top)
{
	const struct status_page *page;
	int is_alive;
	int r = source_try_status(top->cli, &page);

	if (r < 0) {
		return r == -ENOENT;
	}
	is_alive = page_is_alive(page->pid);
	source_status_close(page);
	return !is_alive;
}

/* ecdaqd may be starting: the page of an earlier one does not count. */
static void wait_for_page(struct top *top)
{
	const int64_t step_ns = 50 * NS_PER_MS;

	for (int64_t waited_ns = 0; waited_ns < top->wait_ns && !screen_is_over();
	     waited_ns += step_ns) {
		if (!is_worth_waiting(top)) {
			return;
		}
		if (waited_ns == 4 * step_ns && screen_is_terminal()) {
			printf("waiting for ecdaqd in %s (Ctrl-C: leave)\n", top->cli->dir);
			fflush(stdout);
		}
		screen_wait(step_ns);
	}
}

static enum exit_code parse_sort(struct top *top)
{
	if (top->sort_word == NULL) {
		return EXIT_CODE_OK;
	}
	for (unsigned i = 0; report_sort_to_str(i) != NULL; i++) {
		if (strcmp(report_sort_to_str(i), top->sort_word) == 0) {
			top->sort = i;
			return EXIT_CODE_OK;
		}
	}
	return cli_fail(top->cli, EXIT_CODE_USAGE,
			"--sort: %s: expected trouble, position, name, bad or errors",
			top->sort_word);
}

enum exit_code verb_top(struct cli *cli, int argc, char **argv)
{
	struct top top = {
		.cli = cli,
		.interval_ns = NS_PER_S / 2,
		.is_live = screen_is_terminal(),
		.wait_ns = screen_is_terminal() ? 10 * NS_PER_S : 0,
		.leave_text = "q: leave",
		.sort = REPORT_BY_TROUBLE,
		.detail = -1,
	};
	const struct args_option options[] = {
		{ "interval", 'i', args_duration, &top.interval_ns, "T",
		  "time between updates (500ms)" },
		{ "count", 'n', args_count, &top.count, "N", "end after N updates" },
		{ "wait", 0, args_duration, &top.wait_ns, "T",
		  "how long to wait for ecdaqd to start (10s on a terminal, else 0s)" },
		{ "sort", 0, args_text, &top.sort_word, "ORDER",
		  "of the slaves: trouble, position, name, bad or errors (trouble)" },
		{ "json", 0, args_flag, &top.is_json, NULL,
		  "a line of JSON each update, as from status" },
		{ "leave-text", 0, args_text, &top.leave_text, "TEXT",
		  "what q does, for the last line (q: leave)" },
	};
	struct args args = { .options = options, .option_count = 6 };
	const struct status_page *page;
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = parse_sort(&top);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	top.is_live = top.is_live && !top.is_json;
	screen_catch_signals();
	wait_for_page(&top);
	if (screen_is_over()) {
		return EXIT_CODE_OK;
	}
	result = source_status(cli, &page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (top.is_live) {
		screen_begin();
	}
	result = follow(&top, &page);
	source_status_close(page);
	return result;
}
