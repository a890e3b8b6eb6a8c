/* SPDX-License-Identifier: MIT */
/* ecdaq sync0: what ecdaq-sync0 found, as a table, as bars, or as JSON. */
#include "base/sync0.h"

#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/args.h"
#include "cli/bars.h"
#include "cli/cli.h"
#include "cli/sync0_source.h"
#include "cli/text.h"
#include "program/beside.h"
#include "program/json.h"
#include "reader/feed.h"
#include "reader/page.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

/* Results that are looked through for the newest of each line. */
#define NEWEST (UINT64_C(4) * LIMIT_SYNC0_LINES)

enum { PROGRAM_ARGUMENTS = 8 };

struct view {
	const struct sync0_status *page;
	int is_running;
	uint32_t lines;
	int has_result[LIMIT_SYNC0_LINES];
	struct sync0_result result[LIMIT_SYNC0_LINES]; /* the newest of each line */
};

/* The newest result of each line is among the last few of the ring. */
static void read_results(struct cli *cli, struct view *view)
{
	char path[CONFIG_PATH_BYTES];
	struct sync0_result r;
	struct feed *feed;
	uint64_t lost = 0;

	if (cli_path(cli, CONFIG_RUN_SYNC0, path) != EXIT_CODE_OK) {
		return;
	}
	feed = feed_create(FEED_SYNC0, path, FEED_AT_OLDEST);
	if (feed != NULL && feed_open(feed, NULL) == 0) {
		feed_seek_back(feed, NEWEST);
		while (feed_read(feed, &r, sizeof(r), NULL, &lost)) {
			if (r.line < view->lines) {
				view->result[r.line] = r;
				view->has_result[r.line] = 1;
			}
		}
	}
	feed_destroy(feed);
}

/* An optional slave that the master has not found. */
static int is_absent(const struct sync0_line_status *ls)
{
	return ls->slave_pos == EVENT_NO_SLAVE;
}

/* Nothing of the line is judged while the master is the same. */
static int is_unchecked(const struct sync0_line_status *ls)
{
	return is_absent(ls) || (ls->cycle_ns == 0 && !ls->is_oneshot);
}

/* "slave 1" */
static const char *slave_text(const struct sync0_line_status *ls, char text[TEXT_BYTES])
{
	snprintf(text, TEXT_BYTES, is_absent(ls) ? "slave absent" : "slave %u", ls->slave_pos);
	return text;
}

static void write_line(const struct view *view, uint32_t number)
{
	const struct sync0_line_status *ls = &view->page->line[number];
	char name[TEXT_BYTES * 2];
	char line[TEXT_BYTES * 4];
	char slave[TEXT_BYTES];
	char text[512];

	printf("line %u     %s, %s, %s%s%s: %s%s\n", number + 1,
	       text_plain(ls->slave, name, sizeof(name)), slave_text(ls, slave),
	       text_plain(ls->line, line, sizeof(line)), ls->is_oneshot ? ", one-shot" : "",
	       ls->is_hte ? ", hardware timestamps" : "",
	       !ls->is_open       ? "NOT OPEN"
	       : is_unchecked(ls) ? "NOT CHECKED"
	       : GET(ls->is_lost) ? "LOST"
				  : sync0_verdict_to_str(GET(ls->verdict)),
	       GET(ls->edges) == 0 ? ", no window yet" : "");
	printf("           %" PRIu64 " edges   %" PRIu64 " missing   %" PRIu64 " extra   %" PRIu64
	       " dropped   %" PRIu64 " steps",
	       GET(ls->edges), GET(ls->missing), GET(ls->extra), GET(ls->overflow), GET(ls->steps));
	if (ls->is_oneshot) {
		printf("   %" PRIu64 " shots, %" PRIu64 " lost", GET(ls->shots),
		       GET(ls->shots_lost));
	}
	putchar('\n');
	if (view->has_result[number]) {
		sync0_result_format(&view->result[number], text, sizeof(text));
		printf("           %s\n", text);
	}
}

static void write_table(const struct view *view)
{
	const struct sync0_status *page = view->page;
	char text[sizeof(page->message)];
	char plain[sizeof(text)];
	char window[TEXT_BYTES];
	char noise[TEXT_BYTES];

	printf("sync0      %s%s: %s   %" PRIu64 " windows of %s   %" PRIu64 " alarms\n",
	       sync0_source_to_str(page->source), view->is_running ? "" : " (not running)",
	       sync0_state_to_str(GET(page->state)), GET(page->windows),
	       text_ns(GET(page->window_ns), window), GET(page->alarms));
	if (page->source == SYNC0_SIMULATED) {
		puts("           simulated edges of ecdaq-sim: they include no wire and no "
		     "interrupt");
	} else if (GET(page->noise_p99_ns) < 0) {
		puts("           not calibrated: phase and skew are UNRESOLVED (ecdaq sync0 "
		     "calibrate)");
	} else {
		printf("           resolution of this board: p99 %s; jitter below that is not "
		       "verified\n",
		       text_ns(GET(page->noise_p99_ns), noise));
	}
	if (page->message[0] != '\0') {
		printf("message    %s\n", text_plain(page->message, plain, sizeof(plain)));
	}
	if (sync0_beyond_format(page, text, sizeof(text)) > 0) {
		puts(text_plain(text, plain, sizeof(plain)));
	}
	for (uint32_t i = 0; i < view->lines; i++) {
		write_line(view, i);
	}
}

static void write_figures(struct json *js, const struct sync0_result *r)
{
	json_u64(js, "first_cycle", r->first_cycle);
	json_u64(js, "cycles", r->cycles);
	json_u64(js, "edges", r->edges);
	json_u64(js, "missing", r->missing);
	json_u64(js, "extra", r->extra);
	json_u64(js, "overflow", r->overflow);
	json_i64(js, "step_ns", r->step_ns);
	json_double(js, "period_ns", r->period_ns);
	json_double(js, "period_sd_ns", r->period_sd_ns);
	json_i64(js, "jitter_p50_ns", r->jitter_p50_ns);
	json_i64(js, "jitter_p99_ns", r->jitter_p99_ns);
	json_i64(js, "jitter_max_ns", r->jitter_max_ns);
	json_double(js, "drift_ppb", r->drift_ppb);
	json_double(js, "drift_error_ppb", r->drift_error_ppb);
	json_double(js, "rate_ppb", r->rate_ppb);
	json_double(js, "rate_error_ppb", r->rate_error_ppb);
	json_i64(js, "phase_ns", r->phase_ns);
	json_i64(js, "phase_error_ns", r->phase_error_ns);
	json_i64(js, "frame_ns", r->frame_ns);
	json_i64(js, "skew_ns", r->skew_ns);
	json_i64(js, "skew_error_ns", r->skew_error_ns);
	json_i64(js, "dc_diff_ns", r->dc_diff_ns);
}

static void write_result(struct json *js, const struct sync0_result *r)
{
	static const struct {
		uint32_t bit;
		const char *name;
	} figures[] = { { SYNC0_HAS_JITTER, "jitter" },
			{ SYNC0_HAS_DRIFT, "drift" },
			{ SYNC0_HAS_RATE, "rate" },
			{ SYNC0_HAS_PHASE, "phase" },
			{ SYNC0_HAS_SKEW, "skew" } };

	json_object_begin(js, r->kind == SYNC0_SHOT ? "shot" : "window");
	json_text(js, "verdict", sync0_verdict_to_str(r->verdict));
	json_object_begin(js, "checks");
	for (uint32_t i = 0; i < SYNC0_CHECKS; i++) {
		json_text(js, sync0_check_to_str(i), sync0_verdict_to_str(r->check[i]));
	}
	json_object_end(js);
	json_array_begin(js, "resolved");
	for (size_t i = 0; i < sizeof(figures) / sizeof(figures[0]); i++) {
		if (r->is_resolved & figures[i].bit) {
			json_text(js, NULL, figures[i].name);
		}
	}
	json_array_end(js);
	if (r->kind == SYNC0_SHOT) {
		json_truth(js, "came", r->has_come);
		json_i64(js, "dc_time_ns", r->shot_dc_ns);
		json_i64(js, "late_ns", r->shot_late_ns);
		json_i64(js, "late_error_ns", r->phase_error_ns);
	} else {
		write_figures(js, r);
	}
	json_object_end(js);
}

static void write_line_json(struct json *js, const struct view *view, uint32_t number)
{
	const struct sync0_line_status *ls = &view->page->line[number];
	char text[SYNC0_LINE_BYTES];

	json_object_begin(js, NULL);
	json_u64(js, "line", number + 1);
	json_i64(js, "slave", is_absent(ls) ? -1 : (int64_t)ls->slave_pos);
	json_text(js, "name", text_plain(ls->slave, text, sizeof(ls->slave)));
	json_text(js, "gpio", text_plain(ls->line, text, sizeof(text)));
	json_truth(js, "open", ls->is_open != 0);
	json_truth(js, "oneshot", ls->is_oneshot != 0);
	json_truth(js, "hte", ls->is_hte != 0);
	json_u64(js, "cycle_ns", ls->cycle_ns);
	json_i64(js, "shift_ns", ls->shift_ns);
	json_truth(js, "lost", GET(ls->is_lost) != 0);
	json_text(js, "verdict", sync0_verdict_to_str(GET(ls->verdict)));
	json_u64(js, "edges", GET(ls->edges));
	json_u64(js, "missing", GET(ls->missing));
	json_u64(js, "extra", GET(ls->extra));
	json_u64(js, "overflow", GET(ls->overflow));
	json_u64(js, "steps", GET(ls->steps));
	json_u64(js, "shots", GET(ls->shots));
	json_u64(js, "shots_lost", GET(ls->shots_lost));
	if (view->has_result[number]) {
		write_result(js, &view->result[number]);
	}
	json_object_end(js);
}

static void write_json(const struct view *view)
{
	const struct sync0_status *page = view->page;
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_text(&js, "source", sync0_source_to_str(page->source));
	json_truth(&js, "running", view->is_running);
	json_i64(&js, "pid", page->pid);
	json_text(&js, "state", sync0_state_to_str(GET(page->state)));
	json_u64(&js, "windows", GET(page->windows));
	json_i64(&js, "window_ns", GET(page->window_ns));
	json_u64(&js, "alarms", GET(page->alarms));
	if (GET(page->noise_p99_ns) < 0) {
		json_null(&js, "noise_p99_ns");
	} else {
		json_i64(&js, "noise_p99_ns", GET(page->noise_p99_ns));
	}
	json_text(&js, "message", page->message);
	json_u64(&js, "beyond", GET(page->beyond_count));
	json_array_begin(&js, "lines");
	for (uint32_t i = 0; i < view->lines; i++) {
		write_line_json(&js, view, i);
	}
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}

static void write_bars(const struct view *view)
{
	char name[TEXT_BYTES * 2];
	char slave[TEXT_BYTES];

	puts("difference of each SYNC0 period from nominal, including measurement "
	     "noise");
	for (uint32_t i = 0; i < view->lines; i++) {
		const struct sync0_line_status *ls = &view->page->line[i];

		printf("line %u, %s %s\n", i + 1, slave_text(ls, slave),
		       text_plain(ls->slave, name, sizeof(name)));
		bars_print(&ls->deviation);
	}
}

/* ecdaq-sync0 beside this program: it alone may see the lines. Returns only when that failed. */
static enum exit_code run_calibration(const struct cli *cli)
{
	char program[PATH_MAX];
	char *words[PROGRAM_ARGUMENTS];
	int n = 0;
	int r = program_beside("ecdaq-sync0", program);

	if (r < 0) {
		return cli_fail(cli, EXIT_CODE_FAILED, "/proc/self/exe: %s", strerror(-r));
	}
	words[n++] = program;
	words[n++] = (char *)(uintptr_t)"--calibrate";
	if (cli->config != NULL) {
		words[n++] = (char *)(uintptr_t)"--config";
		words[n++] = (char *)(uintptr_t)cli->config;
	}
	words[n] = NULL;
	execv(program, words);
	return cli_fail(cli, EXIT_CODE_FAILED, "%s: %s", program, strerror(errno));
}

static enum exit_code show(struct cli *cli, int is_json, int is_histogram)
{
	struct view view = { .page = NULL };
	enum exit_code result = sync0_source_open(cli, &view.page);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	view.is_running = page_is_alive(view.page->pid);
	view.lines = sync0_source_lines(view.page);
	read_results(cli, &view);
	if (is_json) {
		write_json(&view);
	} else if (is_histogram) {
		write_bars(&view);
	} else {
		write_table(&view);
	}
	sync0_source_close(view.page);
	return EXIT_CODE_OK;
}

enum exit_code verb_sync0(struct cli *cli, int argc, char **argv)
{
	int is_json = 0;
	int is_histogram = 0;
	const struct args_option options[] = {
		{ "json", 0, args_flag, &is_json, NULL, "all of it as one JSON object" },
		{ "histogram", 0, args_flag, &is_histogram, NULL,
		  "the periods of each line as bars" },
	};
	struct args args = { .options = options, .option_count = 2, .operands_max = 1 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (is_json && is_histogram) {
		return cli_fail(cli, EXIT_CODE_USAGE, "--json and --histogram exclude each other");
	}
	if (args.operand_count == 0) {
		return show(cli, is_json, is_histogram);
	}
	if (strcmp(args.operands[0], "calibrate") != 0) {
		return cli_fail(cli, EXIT_CODE_USAGE, "%s: expected calibrate", args.operands[0]);
	}
	if (is_json || is_histogram) {
		return cli_fail(cli, EXIT_CODE_USAGE,
				"calibrate: --json and --histogram are not supported");
	}
	return run_calibration(cli);
}
